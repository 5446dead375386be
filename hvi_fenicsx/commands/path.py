"""``hvi path``: the equilibria of a scene over its load factor, into a result folder."""

from __future__ import annotations

import argparse

from .. import console
from ..load_paths import path_files
from ..load_paths.following import PathRun
from ..model import PathTable
from ..paths.state import End
from ..runtime.mpi import on_root
from ..runtime.writing import Record
from ..workflow import prepare
from . import session
from .session import COMM, LOG, Session, say, tell_moving


def execute(options: argparse.Namespace) -> int:
    """Follow a scene's path into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    return session.execute(
        options,
        _run,
        kind="path",
        done=lambda record: End(record["path"]["end"]) is not End.INTERRUPTED,
        changed=lambda scene: scene.changed(path=scene.path or PathTable()),
    )


def _run(call: Session) -> int:
    """Follow, write and tell; the exit code. Collective."""
    assert call.scene.path is not None
    known = call.begin_journal(path_files.JOURNAL)
    prepared = prepare(call.scene, COMM, call.timer)
    say(console.heading(prepared, COMM.size))
    run = PathRun(prepared, call.scene.path, call.interrupted)
    say(console.path_wanted(call.scene.path, run.scaled))

    def keep(record: Record) -> None:
        on_root(COMM, lambda: call.folder.journal.append(record))
        place = f" on {record['place']['part']}" if record["place"] else ""
        kind = ", unstable" if record["unstable"] else ""
        tell_moving(f"row {len(run.states) - 1}, factor {record['factor']:.6g}{kind}: {record['event']}{place}")

    with call.going_on(path_files.JOURNAL, known):
        if known:
            say([f"{len(known)} rows are there already; on from factor {known[-1]['factor']:.6g}"])
        path = run.follow(known, keep, call.interrupted)
    on_root(COMM, lambda: call.folder.journal.close())
    say(console.path_outcome(path))
    draw = not call.options.no_pictures
    return int(path_files.write(call.folder, run, path, call.given, LOG.info, draw=draw)["exit_code"])
