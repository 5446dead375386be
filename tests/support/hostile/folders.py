"""Folders of results and studies that were damaged, or filled by others, before ``--resume`` and ``--force``."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import json
import os
import random
import shutil
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any
from unittest.mock import patch

import tomli_w
from scenes import model, quadratic_linear

from hvi_fenicsx.commands.cli import main
from hvi_fenicsx.runtime.writing import Journal, _line

from .case import OUT, RUN, SCENE, Case, write
from .requests import STUDY

PATH = ("path", SCENE, "--no-pictures", "--out", OUT)
SEARCH = ("equilibria", SCENE, "--no-pictures", "--out", OUT)
COMMANDS = {"result": RUN, "study": ("study", SCENE, *STUDY, "--out", OUT), "path": PATH, "search": SEARCH}
_APPEND = Journal.append
UNTIL = {"study": (), "result": (), "path": (), "search": ("--limit", "1e-9")}
"""What ends a search before it is done."""
_JSON = [b"", b"[]", b"null", b"{}", b"\xff", b"nan", b"[" * 9999, b'{"files": 3}', b"9" * 5000, b'{"converged": true}']


_LAST = ("path.journal", "search.journal", "study.journal", "study.json", "summary.json")
"""What is written last, of an unfinished result and a finished one."""


@cache
def finished(kind: str) -> Path:
    """A folder of results, of a study, of a path that was killed or of a search that was stopped; made once."""
    folder = Path(mkdtemp(prefix="hvi-finished-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    strong = model(3, 6e6, friction=quadratic_linear(3e6)) | {"path": {"to": 1.0}}
    write(folder, tomli_w.dumps(strong) if kind in ("path", "search") else None)
    with contextlib.chdir(folder), patch.object(Journal, "append", _appended_until_death), contextlib.suppress(_Dead):
        assert main([*COMMANDS[kind], *UNTIL[kind]]) == (4 if kind == "search" else 0)
    return folder


class _Dead(BaseException):
    """The end of a process."""


def _appended_until_death(journal: Journal, record: Any) -> None:
    """As the journal does it, for a few rows of a path."""
    if record.get("factor", 0.0) > 0.5:
        raise _Dead
    _APPEND(journal, record)


def _manifest(out: Path, change: Callable[[dict[str, object]], object]) -> None:
    found = json.loads((out / "manifest.json").read_text())
    change(found)
    (out / "manifest.json").write_text(json.dumps(found))


def _listing(names: list[str]) -> Callable[[random.Random, Path], None]:
    def damage(chance: random.Random, out: Path) -> None:
        _manifest(out, lambda m: m["files"].update({chance.choice(names): None}))  # type: ignore[attr-defined]

    return damage


def no_manifest(chance: random.Random, out: Path) -> None:
    (out / "manifest.json").unlink()


def odd_manifest(chance: random.Random, out: Path) -> None:
    (out / "manifest.json").write_bytes(chance.choice(_JSON))


def odd_entries(chance: random.Random, out: Path) -> None:
    """Other types where the manifest has names and hashes."""
    values: list[object] = [3, None, [], "x", {"a": 3}, {"": None}, {"a\0": None}, {"../scene.toml": "x"}, [["a", "b"]]]
    key = chance.choice(["files", "inputs", "kind", "format", "program"])
    _manifest(out, lambda m: m.update({key: chance.choice(values)}))


def wrong_hashes(chance: random.Random, out: Path) -> None:
    digest = chance.choice(["0" * 64, "", "x", 3, [], True])
    _manifest(out, lambda m: m.update(files=dict.fromkeys(m["files"], digest)))  # type: ignore[call-overload]


def odd_json(chance: random.Random, out: Path) -> None:
    """The file that marks the end, and with a manifest that knows it: as another program would leave it."""
    file = next(out / name for name in _LAST[::-1] if (out / name).exists())
    file.write_bytes(chance.choice(_JSON))
    _manifest(out, lambda m: m["files"].update({file.name: None}))  # type: ignore[attr-defined]


def mine_instead(chance: random.Random, out: Path) -> None:
    """A file of the program's is a link to, or a folder with, files of the user's."""
    files = [f for f in sorted(out.iterdir()) if f.is_file()]
    file = chance.choice(files)
    file.unlink()
    if chance.random() < 0.5:
        file.symlink_to(chance.choice(["../mine.txt", "absent", ".", file.name]))
    else:
        file.mkdir()
        (file / "thesis.txt").write_text("precious")


def mine_beside(chance: random.Random, out: Path) -> None:
    """Files of the user's, with names that the program might take for its own."""
    for name in chance.sample(
        [".notes", "a.png", "points.txt", "summary.json.bak", ".summary.json.part", "x.kept", "\x1b.txt"], 3
    ):
        (out / name).write_text("precious")
    (out / "points2").mkdir()
    (out / "points2" / "summary.json").write_text("{}")
    (out.parent / f"{out.name}.old").mkdir()
    (out.parent / f"{out.name}.partial").write_text("precious")
    (out.parent / f".{out.name}.hvi-0123abcd").mkdir()
    (out.parent / f".{out.name}.hvi-0123abcd" / "thesis.txt").write_text("precious")


def odd_lock(chance: random.Random, out: Path) -> None:
    """The lock's file holds something else, is no file, or is of a process that was killed."""
    lock = out.parent / f".{out.name}.hvi-lock"
    kind = chance.randrange(4)
    if kind == 0:
        lock.write_bytes(chance.choice(_JSON))
    elif kind == 1:
        lock.mkdir()
    elif kind == 2:
        lock.symlink_to(chance.choice(["mine.txt", "absent"]))
    else:
        lock.write_text("hvi_fenicsx: process 1 on another")


def links_for_writing(chance: random.Random, out: Path) -> None:
    """Where the program writes, before it renames, there is a link to, or a second name of, a file of the user's."""
    names = [".manifest.json.part", ".manifest.json.copy", "path.journal", "search.journal", "study.journal"]
    for place in (*(out / name for name in chance.sample(names, 3)), out.parent / f".{out.name}.hvi-new"):
        place.unlink(missing_ok=True)
        kind = chance.randrange(4)
        if kind < 2:
            place.symlink_to(chance.choice([out.parent / "mine.txt", out.parent / "absent", out.parent, place.name]))
        elif kind == 2:
            place.hardlink_to(out.parent / "mine.txt")
        else:
            os.mkfifo(place)


def linked_folder(chance: random.Random, out: Path) -> None:
    """The manifest names a file in a folder that is a link."""
    (out / "sub").symlink_to("..")
    _listing(["sub/mine.txt", "./sub/mine.txt", "sub//mine.txt", "sub", "x" * 300, "\ud800"])(chance, out)


def lies(chance: random.Random, out: Path) -> None:
    """A summary or a journal with values of other types, and right checksums."""
    value = chance.choice([99, -1, None, [], {}, True, "x", {"end": 3}, float("nan")])
    file = next(out / name for name in _LAST if (out / name).exists())
    lines = [file.read_bytes()] if file.suffix == ".json" else file.read_bytes().splitlines(keepends=True)
    records = [json.loads(line[line.index(b"{") :]) for line in lines]
    changed = records[chance.choice([0, -1])]
    changed[chance.choice(["exit_code", "accuracy", "equilibria", "path", *changed])] = value
    file.write_bytes(json.dumps(changed).encode() if file.suffix == ".json" else b"".join(map(_line, records)))
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    _manifest(out, lambda m: m["files"].update({file.name: digest}))  # type: ignore[attr-defined]


def emptied(chance: random.Random, out: Path) -> None:
    for file in chance.sample([f for f in sorted(out.rglob("*")) if f.is_file()], 3):
        raw = file.read_bytes()
        half = raw[: chance.randrange(len(raw) + 1)]
        # shorter, or as a power cut leaves a file whose length is on disk and whose blocks are not
        file.write_bytes(chance.choice([b"", half, half + bytes(len(raw) - len(half))]))


def moved_around(chance: random.Random, out: Path) -> None:
    """The folder is reached by a link, or is a link to itself elsewhere."""
    out.rename(out.parent / "elsewhere")
    out.symlink_to("elsewhere")


_DAMAGES = [
    no_manifest,
    odd_manifest,
    odd_entries,
    wrong_hashes,
    odd_json,
    mine_instead,
    mine_beside,
    odd_lock,
    emptied,
    links_for_writing,
    linked_folder,
    lies,
]
_DAMAGES += [
    moved_around,
    _listing(["../mine.txt", "/etc/hostname", "..", "", ".", "notes", "notes/thesis.txt", "a/../../mine.txt"]),
]


def damaged_folder(chance: random.Random, folder: Path) -> Case:
    """A folder that holds something, damaged, and one of the ways to go on."""
    kind = chance.choice(["result", "result", *COMMANDS])
    shutil.copytree(finished(kind), folder, dirs_exist_ok=True)
    out = folder / OUT
    (folder / "mine.txt").write_text("precious")
    (out / "notes").mkdir()
    (out / "notes" / "thesis.txt").write_text("precious")
    done = chance.sample(_DAMAGES, chance.choice([1, 1, 2]))
    names = []
    for damage in done:
        try:
            damage(chance, out)
        except (OSError, ValueError, KeyError, TypeError, AttributeError, StopIteration):
            continue  # an earlier damage took away what this one works on
        names.append(damage.__name__)
    way = chance.choice([["--force"], ["--resume"], ["--force", "--resume"], []])
    words = [*COMMANDS[kind], *way]
    return Case(what=f"{kind}: {', '.join(names)} {way}", words=words)


KINDS = [damaged_folder, damaged_folder, damaged_folder]
