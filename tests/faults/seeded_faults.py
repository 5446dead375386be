"""Do the tests notice a fault? Faults are put into a copy of the package one at a time, and the fast tests run on it.

    ./hvi exec python3 tests/faults/seeded_faults.py            all faults of seeded_faults.toml, on this tree
    ./hvi exec python3 tests/faults/seeded_faults.py NAME ...   some of them

It takes an hour or two of one core. First all fast tests run once, to learn which lines of the package each executes
and how long it takes (also in the processes that it starts). Then for each fault the tests that execute its lines run,
the cheapest first, of each test function four cases at most, until one fails; tests that start several processes come
first where only those can show the fault.

    --check     only: does each fault's code occur exactly once?
    --old       take the words of an older tree (``before`` in the file), together with --tree DIR
    --tree DIR  another tree than this one
    --work DIR  where the recorded lines and the results are kept and found again (build/faults by default)
    --column C  write the results into this column, "before" or "after", of seeded_faults_result.md
"""

from __future__ import annotations

import argparse
import ast
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PACKAGE = "hvi_fenicsx"
TABLE = HERE / "seeded_faults_result.md"
BATCHES = (5.0, 20.0, 60.0, 200.0, float("inf"))
"""Seconds of tests that are run together: what is caught early shall not wait for all tests to be collected."""
CASES = 4
"""Of a test function with many parameters, the cheapest so many are tried: a fault that none catches is dear."""
_LEFT_OUT = ("/.git", "/build", "/results", "/.hypothesis", "/.pytest_cache", "__pycache__")


@dataclass(frozen=True)
class Fault:
    """One fault: code that occurs once in the package, and what takes its place."""

    name: str
    room: str
    kind: str
    text: str
    put: str
    ranks: bool

    def place(self, tree: Path) -> Path:
        """The file that holds its code.

        Raises:
            LookupError: the code occurs nowhere, or more than once.
        """
        files = [
            f for f in sorted((tree / PACKAGE).rglob("*.py")) for _ in range(f.read_text("utf-8").count(self.text))
        ]
        if len(files) != 1:
            raise LookupError(f"{self.name}: its code occurs {len(files)} times")
        return files[0]


def faults(names: Sequence[str], *, old: bool) -> list[Fault]:
    """The faults of these names, all of them without any."""
    entries = tomllib.loads((HERE / "seeded_faults.toml").read_text("utf-8"))["fault"]
    found = []
    for one in entries:
        text, put = one["text"], one["put"]
        if old:
            text, put = one.get("before", text), one.get("before_put", put)
        found.append(Fault(one["name"], one["room"], one["kind"], text, put, one.get("ranks", False)))
    return [fault for fault in found if not names or fault.name in names]


def environment(tree: Path, **more: str) -> dict[str, str]:
    """Of tests on a tree: the package is that tree's."""
    path = os.pathsep.join([str(tree), str(HERE), str(HERE / "children")])
    return {**os.environ, "PYTHONPATH": path, **more}


def pytest(tree: Path, arguments: Sequence[str], limit: float, **more: str) -> tuple[int | None, str]:
    """Exit code (None after the limit, in seconds) and output of pytest on a tree."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "line_recorder", "-p", "no:cacheprovider", "-m", "not long"]
    process = subprocess.Popen(
        [*command, *arguments],
        cwd=tree,
        env=environment(tree, **more),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    try:
        return _code(process.communicate(timeout=limit)[0], process)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGTERM)
        time.sleep(2.0)
        os.killpg(process.pid, signal.SIGKILL)
        return None, process.communicate()[0]


def _code(output: str, process: subprocess.Popen[str]) -> tuple[int, str]:
    return process.wait(), output


def _copy(source: Path, target: Path) -> None:
    """A tree without what is not of its sources; patterns that begin with a slash are of its top level."""

    def left_out(folder: str, names: list[str]) -> list[str]:
        top = Path(folder) == source
        return [name for name in names if name in _LEFT_OUT or (top and f"/{name}" in _LEFT_OUT)]

    shutil.copytree(source, target, ignore=left_out)


def recorded(tree: Path, work: Path) -> dict[str, Any]:
    """Seconds, lines and ranks of each test on a tree as it is; recorded anew where the folder has no record."""
    target = work / "lines.json"
    if not target.is_file():
        print(f"recording which lines of {tree} each test executes", flush=True)
        more = {"HVI_RECORDED_TARGET": str(target), "HVI_RECORDED_ROOT": str(tree / PACKAGE)}
        code, output = pytest(tree, ["tests"], 7200.0, **more)
        print("\n".join(output.splitlines()[-20:]), flush=True)
        if code not in (0, 1):
            raise SystemExit(f"pytest ended with {code}")
    found = json.loads(target.read_text("utf-8"))
    failed = [name for name, test in found.items() if test["failed"]]
    print(f"{len(found)} tests; left out, since they fail on the tree as it is: {failed or 'none'}", flush=True)
    return {name: test for name, test in found.items() if name not in failed}


def lines_of(fault: Fault, file: Path) -> set[int]:
    """The lines of the statements that a fault changes."""
    source = file.read_text("utf-8")
    at = source.index(fault.text)
    first = source.count("\n", 0, at) + 1
    last = first + fault.text.rstrip("\n").count("\n")
    lines: set[int] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.stmt) and not isinstance(node, ast.FunctionDef | ast.ClassDef):
            body = getattr(node, "body", None)
            end = max(node.lineno, body[0].lineno - 1) if body else node.end_lineno or node.lineno
            if node.lineno <= last and first <= end:
                lines |= set(range(node.lineno, end + 1))
    return lines


def ordered(fault: Fault, tests: dict[str, Any], file: str, lines: set[int]) -> list[str]:
    """The tests that execute these lines: of each test function the cheapest case, cheapest first, then some more."""
    chosen = [name for name, test in tests.items() if lines & set(test["lines"].get(file, ()))]
    seen: dict[str, int] = {}
    keys = {}
    for name in sorted(chosen, key=lambda n: tests[n]["seconds"]):
        function = re.sub(r"\[.*", "", name)
        seen[function] = seen.get(function, -1) + 1
        if seen[function] < CASES:
            keys[name] = (fault.ranks and not tests[name]["parallel"], seen[function] > 0, tests[name]["seconds"])
    return sorted(keys, key=lambda n: keys[n])


def batches(names: Sequence[str], tests: dict[str, Any]) -> Iterator[list[str]]:
    """The tests in pieces of growing length."""
    rest = list(names)
    for most in BATCHES:
        batch: list[str] = []
        while rest and (not batch or sum(tests[n]["seconds"] for n in batch) < most):
            batch.append(rest.pop(0))
        if batch:
            yield batch


def tried(fault: Fault, tree: Path, tests: dict[str, Any], clock: int) -> dict[str, Any]:
    """What becomes of a fault; the tree is as before in the end."""
    file = fault.place(tree)
    source = file.read_text("utf-8")
    names = ordered(fault, tests, str(file.relative_to(tree / PACKAGE)), lines_of(fault, file))
    began = time.perf_counter()
    file.write_text(source.replace(fault.text, fault.put), "utf-8")
    os.utime(file, (clock, clock))  # or Python would take what it compiled before, of the same second and size
    try:
        by = next(filter(None, (_failing(tree, batch, tests) for batch in batches(names, tests))), None)
    finally:
        file.write_text(source, "utf-8")
        os.utime(file, (clock + 1, clock + 1))
    return {"by": by, "seconds": round(time.perf_counter() - began, 1), "covered_by": len(names)}


def _failing(tree: Path, names: list[str], tests: dict[str, Any]) -> str | None:
    """The first of these tests that fails, or None."""
    with tempfile.NamedTemporaryFile("w", suffix=".txt", encoding="utf-8") as order:
        order.write("\n".join(names))
        order.flush()
        files = sorted({name.partition("::")[0] for name in names})
        limit = 120.0 + 6.0 * sum(tests[n]["seconds"] for n in names)
        code, output = pytest(tree, ["-x", *files], limit, HVI_TEST_ORDER=order.name)
    if code is None:
        return "time limit"
    if code in (0, 5):
        return None
    found = re.findall(r"^(?:FAILED|ERROR) (\S.*?)(?: - .*)?$", output, re.MULTILINE)
    return found[0] if found else f"pytest ended with {code}: {output.splitlines()[-1:]}"


def run(options: argparse.Namespace) -> dict[str, Any]:
    """Results by fault, also those of earlier calls."""
    work = options.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    store = work / "results.json"
    results = json.loads(store.read_text("utf-8")) if store.is_file() else {}
    wanted = faults(options.names, old=options.old)
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        tree = Path(folder, "tree")
        _copy(options.tree, tree)
        tests = recorded(tree, work)
        for i, fault in enumerate(wanted):
            if fault.name in results and fault.name not in options.names:
                continue
            results[fault.name] = tried(fault, tree, tests, 1_000_000_000 + 2 * i)
            store.write_text(json.dumps(results, indent=1), "utf-8")
            print(f"{fault.name}: {results[fault.name]}", flush=True)
    return results


def check(options: argparse.Namespace) -> int:
    """Tell which faults' code does not occur exactly once; their number."""
    missing = 0
    for fault in faults(options.names, old=options.old):
        try:
            fault.place(options.tree)
        except LookupError as error:
            print(error)
            missing += 1
    return missing


def write_table(results: dict[str, Any], column: str) -> None:
    """Put results into one column of the table, and leave the other as it is."""
    columns = {"before": _told("before"), "after": _told("after")}
    columns[column] = {
        name: "**not caught**" if one["by"] is None else f"`{one['by'].removeprefix('tests/')}`, {one['seconds']:.0f} s"
        for name, one in results.items()
    }
    every = faults([], old=False)
    lines = [
        "# What the tests notice",
        "",
        "Written by `seeded_faults.py`: for each fault of `seeded_faults.toml` the first fast test that failed.",
        "*Before*: the suite that lay in one folder. *After*: this one.",
        "",
        *(
            f"{name.capitalize()}: {sum('not caught' not in cell for cell in cells.values())} of {len(cells)} caught."
            for name, cells in columns.items()
        ),
        "",
        "| room | fault | kind | before | after |",
        "|---|---|---|---|---|",
    ]
    for fault in every:
        cells = [columns[name].get(fault.name, "") for name in ("before", "after")]
        lines.append(f"| {fault.room} | {fault.name} | {fault.kind} | {cells[0]} | {cells[1]} |")
    TABLE.write_text("\n".join(lines) + "\n", "utf-8")


def _told(column: str) -> dict[str, str]:
    """What the table says in one column, by fault."""
    if not TABLE.is_file():
        return {}
    at = {"before": 4, "after": 5}[column]
    rows = [line.split(" | ") for line in TABLE.read_text("utf-8").splitlines() if line.startswith("| ")][1:]
    cells = {row[1]: row[at - 1].removesuffix(" |") for row in rows}
    return {name: cell for name, cell in cells.items() if cell}


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--old", action="store_true")
    parser.add_argument("--tree", type=Path, default=ROOT)
    parser.add_argument("--work", type=Path, default=ROOT / "build" / "faults")
    parser.add_argument("--column", choices=("before", "after"))
    options = parser.parse_args()
    if missing := check(options):
        return missing
    if options.check:
        return 0
    results = run(options)
    if options.column:
        write_table(results, options.column)
    print(f"{sum(one['by'] is not None for one in results.values())} of {len(results)} faults are caught")
    return 0


if __name__ == "__main__":
    sys.exit(main())
