"""``hvi path``: the equilibria of a scene over its load factor, into a result folder."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from .. import console, path_output, results
from ..equilibrium_paths.state import End
from ..load_path import PathRow
from ..path import journal
from ..path.following import Control, PathRun
from ..path.journal import Journal, Record
from ..runtime import log
from ..runtime.mpi import on_root
from ..runtime.signals import Interrupt
from ..runtime.timing import Timer
from ..scene import PathTable, Scene, read_scene
from ..system import petsc_options
from ..workflow import prepare
from . import target, telling
from .telling import COMM


@dataclass(frozen=True, kw_only=True)
class PathRequest:
    """What ``hvi path`` is asked for.

    Attributes:
        scene: what to follow; it has the table.
        wanted: the table.
        folder: where the result goes.
        known: the records of a path that was begun.
        timer: where time goes.
        given: the command line and PETSc's options, for ``summary.json``.
        draw: whether to make a picture.
    """

    scene: Scene
    wanted: PathTable
    folder: results.ResultFolder
    known: Sequence[Record]
    timer: Timer
    given: dict[str, str]
    draw: bool

    @property
    def identity(self) -> str:
        """What the journal says that it is of."""
        return target.identity(self.scene, self.folder.target)


def execute(options: argparse.Namespace) -> int:
    """Follow a scene's path into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    read = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    wanted = read.path or PathTable()
    scene = read.changed(path=wanted)
    goes_to = target.path_of(options, "-path")
    if options.resume and (code := target.finished(goes_to, scene, "the path is followed again", _done)) is not None:
        return code
    with target.opened(options, goes_to) as folder:
        known = on_root(COMM, lambda: _known(folder, scene) if options.resume else [])
        request = PathRequest(
            scene=scene,
            wanted=wanted,
            folder=folder,
            known=known,
            timer=timer,
            given=target.given(options),
            draw=not options.no_pictures,
        )
        return _run(request)


def _known(folder: results.ResultFolder, scene: Scene) -> list[Record]:
    """The records of a path that was begun. Rank 0 only."""
    return journal.read(folder.target / journal.NAME, target.identity(scene, folder.target))


def _done(record: dict[str, Any]) -> bool:
    """Whether a summary is of a path that came to its end."""
    return record.get("path") is not None and record["path"]["end"] != End.INTERRUPTED


def _run(request: PathRequest) -> int:
    """Follow, write and tell; the exit code. Collective."""
    interrupt = Interrupt(COMM)
    interrupt.watch()
    folder, run_logs = request.folder, telling.on_first_rank(lambda: log.RunLog(request.folder.work / "run.log"))
    with log.Handlers(*telling.on_first_rank(log.TerminalDisplay)):
        with log.Handlers(*run_logs):
            record = _followed(request, interrupt)
        on_root(COMM, lambda: telling.finish(run_logs))
        folder.commit(request.scene)
        telling.say([*console.warnings(folder.kept), target.where(folder.target, request.timer)])
    return int(record["exit_code"])


def _followed(request: PathRequest, interrupt: Interrupt) -> dict[str, Any]:
    """The summary of the path that was followed and written. Collective."""
    prepared = prepare(request.scene, COMM, request.timer)
    telling.say(console.heading(prepared, COMM.size))
    run = PathRun(prepared, request.wanted, interrupt.requested)
    telling.say(console.path_wanted(request.wanted, run.scaled))
    if request.known:
        telling.say([f"{len(request.known)} rows are there already; on from factor {request.known[-1]['factor']:.6g}"])
    writer = _JournalWriter(request)
    control = Control(keep=writer.keep, progress=_tell, interrupted=interrupt.requested, jumping=_tell_jump)
    path = run.follow(control, request.known)
    on_root(COMM, writer.close)
    telling.say(console.path_outcome(path))
    return path_output.write(request.folder, run, path, request.given, telling.LOG.info, draw=request.draw)


class _JournalWriter:
    """Keeps each new state in the folder of the result; the file is opened with the first of them."""

    def __init__(self, request: PathRequest) -> None:
        self._request = request
        self._journal: Journal | None = None

    def keep(self, record: Record) -> None:
        """Keep a record. Collective."""
        on_root(COMM, lambda: self._append(record))

    def _append(self, record: Record) -> None:
        if self._journal is None:
            file = self._request.folder.announce(journal.NAME)
            if not self._request.known:
                file.unlink(missing_ok=True)
            self._journal = Journal(file, self._request.identity)
        self._journal.append(record)

    def close(self) -> None:
        """Close the file, if there is one. Rank 0 only."""
        if self._journal is not None:
            self._journal.close()


def _tell_jump(factor: float, steps: int) -> None:
    """The moving line in the middle of a long jump."""
    telling.LOG.debug("jump at the factor %.6g, step %d", factor, steps, extra={"moving": True})


def _tell(number: int, row: PathRow) -> None:
    """The moving line."""
    place = f" on {row.part}" if row.part else ""
    kind = "" if row.stable else ", unstable"
    telling.LOG.debug("row %d, factor %.6g%s: %s%s", number, row.factor, kind, row.event, place, extra={"moving": True})
