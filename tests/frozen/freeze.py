"""Frozen numbers: what commands gave at a commit, and whether they still do.

    ./hvi exec python3 tests/frozen/freeze.py compare                   all sets; exit code 1 where any differs
    ./hvi exec python3 tests/frozen/freeze.py compare --quick           cases of a few seconds of processor time
    ./hvi exec python3 tests/frozen/freeze.py compare paths --only glued
    ./hvi exec python3 tests/frozen/freeze.py record curved             writes golden/curved.json anew
    /another/tree/hvi exec python3 tests/frozen/freeze.py record curved    the same by the program of another tree
    ./hvi exec python3 tests/frozen/freeze.py list

It knows the command line and the files of results only. A set is a table of cases.toml, or one of the lists elsewhere:
`demos` checks and runs every demo, `paths` is benchmarks/paths.toml, `verification` is verification/cases.toml.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import resource
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w
from comparison import CURVED, EXACT, differences
from records import Record, record

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
GOLDEN = HERE / "golden"
QUICK = 6.0
"""Cases that took no longer than this when they were recorded, s, are quick."""
LIMIT = 3600.0
Execute = Callable[[list[str], int], "tuple[int, str]"]
"""Runs the words of a command on ranks; its exit code and what it printed."""


@dataclass(frozen=True)
class Case:
    """One command whose result is frozen.

    Attributes:
        group: the set that it belongs to.
        name: within the set.
        command: run, check, path or equilibria.
        scene: a file, or the tables of one.
        changes: as of ``--set``.
        words: further ones of the command line.
        ranks: that it runs on.
        curved: whether a path is followed by steps.
        searched: whether equilibria are looked for without a proof that there are no others.
    """

    group: str
    name: str
    command: str
    scene: Path | Mapping[str, Any]
    changes: tuple[str, ...] = ()
    words: tuple[str, ...] = ()
    ranks: int = 1
    curved: bool = False
    searched: bool = False
    tables: Mapping[str, Any] = field(default_factory=dict)

    def recorded(self, folder: Path, execute: Execute) -> Record:
        """What the program gives now.

        Args:
            folder: an empty one.
            execute: how commands are run.
        """
        scene = self.scene
        if not isinstance(scene, Path):
            scene = folder / "given.toml"
            scene.write_text(tomli_w.dumps(dict(self.scene)), encoding="utf-8")  # type: ignore[arg-type]
        words = [self.command, str(scene), *(f"--set={change}" for change in self.changes), *self.words]
        words += ["--json"] if self.command == "check" else ["--out", str(folder / "out"), "--no-pictures"]
        code, output = execute(words, self.ranks)
        return record(self.command, code, output, folder / "out")

    def differences(self, old: Record, new: Record) -> list[str]:
        """What two records of it differ in.

        Args:
            old: the golden one.
            new: the one now.
        """
        return differences(old, new, CURVED if self.curved else EXACT, searched=self.searched)


def cases() -> dict[str, list[Case]]:
    """All sets."""
    tables = _read(HERE / "cases.toml")
    scenes = tables.pop("scene")
    found = {group: [_case(group, entry, scenes) for entry in entries] for group, entries in tables.items()}
    return {"demos": list(_demos())} | found | {"paths": list(_paths()), "verification": list(_verification())}


def _read(file: Path) -> dict[str, Any]:
    return tomllib.loads(file.read_text(encoding="utf-8"))


def _case(group: str, entry: Mapping[str, Any], scenes: Mapping[str, Any]) -> Case:
    given = dict(entry)
    scene, changes = given.pop("scene"), tuple(given.pop("set", ()))
    table = scenes.get(scene, ROOT / scene)
    words = tuple(given.pop("words", ()))
    name = given.pop("name", Path(scene).stem)
    return Case(group=group, name=name, scene=table, changes=changes, words=words, **given)


def _demos() -> Iterator[Case]:
    for scene in sorted((ROOT / "demos").glob("*.toml")):
        for command in ("check", "run"):
            yield Case("demos", f"{command} {scene.stem}", command, scene)


def _paths() -> Iterator[Case]:
    tables = _read(ROOT / "benchmarks" / "paths.toml")
    for name, scene, changes in tables.pop("paths"):
        table = tables.get(scene, ROOT / "demos" / f"{scene}.toml")
        yield Case("paths", name, "path", table, tuple(changes))


def _verification() -> Iterator[Case]:
    for entry in _read(ROOT / "verification" / "cases.toml")["case"]:
        command, scene, *words = entry["command"]
        curved = command == "path"  # whatever it is: the page's own tolerances are far wider
        yield Case("verification", entry["name"], command, ROOT / scene, words=tuple(words), curved=curved)


def golden(group: str) -> dict[str, dict[str, Any]]:
    """The frozen records of a set, by name: processor time, s, and the record.

    Args:
        group: its name.
    """
    file = GOLDEN / f"{group}.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}


def write(group: str, records: Mapping[str, Any]) -> None:
    """A set's golden file, a line a case.

    Args:
        group: its name.
        records: by name.
    """
    lines = [f"{json.dumps(name)}: {json.dumps(value, separators=(',', ':'))}" for name, value in records.items()]
    (GOLDEN / f"{group}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def executed(words: list[str], ranks: int) -> tuple[int, str]:
    """A command, of the tree whose launcher started this script; on one rank within this process, which saves imports.

    Args:
        words: of the command line.
        ranks: to run it on.
    """
    if ranks == 1:
        from hvi_fenicsx.commands.cli import main as hvi

        printed = io.StringIO()
        with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(io.StringIO()):
            return hvi(words), printed.getvalue()
    start = ["mpirun", "-n", str(ranks), sys.executable, "-P", "-m", "mpi4py", "-m", "hvi_fenicsx"]
    patient = {**os.environ, "OMPI_MCA_mpi_yield_when_idle": "1"}  # or ranks that wait would take others' cores
    done = subprocess.run([*start, *words], capture_output=True, text=True, check=False, timeout=LIMIT, env=patient)
    return done.returncode, done.stdout


def timed(case: Case) -> dict[str, Any]:
    """A case's record, and the processor time that it took, s.

    Args:
        case: to be run.
    """
    with tempfile.TemporaryDirectory() as folder:
        start = _processor_time()
        found = case.recorded(Path(folder), executed)
        return {"seconds": round(_processor_time() - start, 1), "record": found}


def _processor_time() -> float:
    """Of this process and of those that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def chosen(options: argparse.Namespace) -> dict[str, list[Case]]:
    """The cases that the command line asks for."""
    every = cases()
    if unknown := set(options.sets) - set(every):
        raise SystemExit(f"there is no set {', '.join(sorted(unknown))}; there are {', '.join(every)}")
    found = {}
    for group in options.sets or every:
        known = golden(group)
        named = [case for case in every[group] if options.only in case.name]
        quick = [case for case in named if known.get(case.name, {}).get("seconds", QUICK) < QUICK]
        found[group] = quick if options.quick else named
    return found


def compare(options: argparse.Namespace) -> int:
    """Differences as they are found, then the table; 1 where there are any."""
    rows = []
    for group, members in chosen(options).items():
        known = golden(group)
        asked = [case for case in members if case.name in known]
        apart = 0
        for case in asked:
            found = timed(case)
            lines = case.differences(known[case.name]["record"], found["record"])
            apart += bool(lines)
            if lines or options.verbose:
                seconds = f"{known[case.name]['seconds']} -> {found['seconds']} s"
                print(f"{group}: {case.name} ({seconds})", *lines, sep="\n    ", flush=True)
        rows.append((group, len(asked), len(asked) - apart, apart))
    print(f"{'set':14}{'cases':>8}{'same':>8}{'differ':>8}")
    for row in rows:
        print("{:14}{:8}{:8}{:8}".format(*row))
    return int(any(row[-1] for row in rows))


def record_sets(options: argparse.Namespace) -> int:
    """Golden files, those of the cases asked for anew, the others as they are."""
    for group, members in chosen(options).items():
        known = golden(group)
        asked = [case for case in members if not (options.missing and case.name in known)]
        for case in asked:
            known[case.name] = found = timed(case)
            print(f"{group}: {case.name}, {found['seconds']} s, code {found['record']['code']}", flush=True)
            write(group, {c.name: known[c.name] for c in cases()[group] if c.name in known})
    return 0


def list_sets(options: argparse.Namespace) -> int:
    """Sets with their numbers of cases and the processor time they took."""
    for group, members in chosen(options).items():
        known = golden(group)
        seconds = sum(known[case.name]["seconds"] for case in members if case.name in known)
        print(f"{group:14}{len(members):4} cases{seconds:8.0f} s")
    return 0


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    actions = {"compare": compare, "record": record_sets, "list": list_sets}
    parser.add_argument("action", choices=actions)
    parser.add_argument("sets", nargs="*", metavar="SET")
    parser.add_argument("--only", default="", metavar="WORDS", help="cases whose names contain this")
    parser.add_argument("--quick", action="store_true", help=f"cases that took less than {QUICK:g} s")
    parser.add_argument("--missing", action="store_true", help="record only what is not recorded yet")
    parser.add_argument("--verbose", action="store_true", help="every case with its time, not only those that differ")
    options = parser.parse_args()
    return actions[options.action](options)


if __name__ == "__main__":
    sys.exit(main())
