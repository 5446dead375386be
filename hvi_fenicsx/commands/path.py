"""``hvi path``: the equilibria of a scene over its load factor, into a result folder."""

from __future__ import annotations

import argparse

from .. import console
from ..load_paths import path_files
from ..load_paths.following import Control, PathRun
from ..model import Model, PathTable
from ..paths.load_path import PathRow
from ..paths.state import End
from ..runtime import writing
from ..runtime.mpi import on_root
from ..runtime.writing import Journal
from ..workflow import prepare
from . import session
from .session import COMM, LOG, Record, Session, say, tell_moving


def execute(options: argparse.Namespace) -> int:
    """Follow a scene's path into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """

    def done(record: Record) -> bool:
        return record.get("path") is not None and record["path"]["end"] != End.INTERRUPTED

    def changed(scene: Model) -> Model:
        return scene.changed(path=scene.path or PathTable())

    return session.execute(options, _run, suffix="-path", done=done, changed=changed)


def _run(call: Session) -> int:
    """Follow, write and tell; the exit code. Collective."""
    assert call.scene.path is not None
    known = on_root(COMM, lambda: call.journal(path_files.JOURNAL))
    kept = _StateFile(call, known)
    prepared = prepare(call.scene, COMM, call.timer)
    say(console.heading(prepared, COMM.size))
    run = PathRun(prepared, call.scene.path, call.interrupted)
    say(console.path_wanted(call.scene.path, run.scaled))
    if known:
        say([f"{len(known)} rows are there already; on from factor {known[-1]['factor']:.6g}"])
    control = Control(keep=kept.keep, progress=_tell, interrupted=call.interrupted)
    path = run.follow(control, known)
    on_root(COMM, kept.close)
    say(console.path_outcome(path))
    draw = not call.options.no_pictures
    return int(path_files.write(call.folder, run, path, call.given, LOG.info, draw=draw)["exit_code"])


class _StateFile:
    """Keeps each new state in the folder of the result; the file is opened with the first of them."""

    def __init__(self, call: Session, known: list[writing.Record]) -> None:
        self._call, self._journal, self._known = call, list[Journal](), known

    def keep(self, record: writing.Record) -> None:
        """Keep a state. Collective."""
        on_root(COMM, lambda: self._append(record))

    def _append(self, record: writing.Record) -> None:
        if not self._journal:
            file = self._call.folder.announce(path_files.JOURNAL)
            if not self._known:
                file.unlink(missing_ok=True)
            self._journal.append(Journal(file, self._call.identity))
        self._journal[0].append(record)

    def close(self) -> None:
        """Close the file, if there is one. Rank 0 only."""
        for opened in self._journal:
            opened.close()


def _tell(number: int, row: PathRow) -> None:
    """The moving line."""
    place = f" on {row.part}" if row.part else ""
    kind = "" if row.stable else ", unstable"
    tell_moving(f"row {number}, factor {row.factor:.6g}{kind}: {row.event}{place}")
