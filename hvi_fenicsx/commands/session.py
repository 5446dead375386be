"""What commands share that write a folder: the ranks, the folder, its log, a request to stop, and what is told."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from .. import console, results
from ..errors import ExitCode
from ..model import Model, dump_scene, read_scene
from ..report.page import NAME as PAGE
from ..results.output_folder import inputs_of, read_finished
from ..runtime import log
from ..runtime.cost import Timer
from ..runtime.manifest import MARKS, Kind, __version__
from ..runtime.mpi import on_root, stop_on_signals
from ..runtime.writing import Record, understood
from ..system import petsc_options

COMM = MPI.COMM_WORLD
LOG = log.logger("commands")


@dataclass(frozen=True)
class Session:
    """One call of such a command.

    Attributes:
        options: the words of the command line.
        scene: what it is of.
        folder: where the result goes.
        timer: where time goes.
        interrupted: whether to stop (collective).
    """

    options: argparse.Namespace
    scene: Model
    folder: results.ResultFolder
    timer: Timer
    interrupted: Callable[[], bool]

    @property
    def given(self) -> dict[str, Any]:
        """The command line and PETSc's options, for ``summary.json``."""
        return {"command": self.options.given, "petsc": self.options.petsc}

    def begin_journal(self, name: str) -> list[Record]:
        """What an unfinished result has left in a journal, if this call shall go on from it. Collective.

        It is of a scene; on other ranks the unknowns have another order, and other files make another problem.
        """
        target = self.folder.target
        others = f"{__version__} {COMM.size} {inputs_of(self.scene, target)}"
        return on_root(COMM, lambda: self.folder.begin_journal(name, [dump_scene(self.scene, target), others]))

    def going_on(self, name: str, known: Sequence[Record]) -> AbstractContextManager[None]:
        """Whatever comes of records that a journal had is told of its file.

        Args:
            name: of the journal.
            known: the records.
        """
        return understood(self.folder.target / name) if known else nullcontext()


def execute(
    options: argparse.Namespace,
    work: Callable[[Session], int],
    *,
    kind: Kind = "result",
    done: Callable[[Record], bool],
    changed: Callable[[Model], Model] = lambda scene: scene,
) -> int:
    """Have a command write its folder, unless that is finished already; the exit code. Collective.

    Args:
        options: the words of the command line.
        work: writes all files but ``run.log``, and gives the exit code (collective).
        kind: of what it writes.
        done: whether a summary is of what is asked for, and finished. Rank 0 only.
        changed: what the command makes of the scene.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    scene, target = changed(scene_of(options)), target_of(options)
    resume = options.resume and not options.force
    if resume and (code := on_root(COMM, lambda: _finished(target, scene, kind, done))) is not None:
        return code
    inputs = [options.scene, *scene.files()]
    with results.ResultFolder(COMM, target, force=options.force, resume=resume, inputs=inputs, kind=kind) as folder:
        interrupted, run_log = stop_on_signals(COMM), log.RunLog(folder.work / "run.log")
        with display():
            with log.handled(run_log):
                code = work(Session(options, scene, folder, timer, interrupted))
            on_root(COMM, run_log.finish)
            folder.commit(scene)
            say(console.warnings([*folder.kept, *petsc_options.unread(options.petsc)]))
            first = on_root(COMM, lambda: f"; open {PAGE} there" if (target / PAGE).is_file() else "")
            say([f"{target}: {timer.total:.1f} s in all{first}"])
    return int(code)


def scene_of(options: argparse.Namespace) -> Model:
    """The scene that the words of the command line name. Collective."""
    return on_root(COMM, lambda: read_scene(options.scene, options.overrides))


def target_of(options: argparse.Namespace) -> Path:
    """The folder that they name, or by default one of the name of scene and command. Collective."""
    name = options.scene.stem + ("" if options.command == "run" else f"-{options.command}")
    return on_root(COMM, lambda: results.resolved(options.out or Path("results") / name))


def _finished(target: Path, scene: Model, kind: Kind, done: Callable[[Record], bool]) -> int | None:
    """The exit code of a finished result of the same scene, which is told; None where there is none. Rank 0 only."""
    with understood(target / MARKS["result"]):
        record, fault = read_finished(target, scene, kind)
        if fault is not None:
            log.say(f"{target}: {fault}; the scene is run again")
        if record is None or not done(record):
            return None
        code = ExitCode(record["exit_code"])
        log.say(f"{target}: finished already ({record['reason']})")
        return code


def display() -> AbstractContextManager[None]:
    """Shows the lines of the command on the terminal, in a block; on rank 0."""
    return log.handled(*([log.TerminalDisplay()] if COMM.rank == 0 else []))


def say(lines: Iterable[str]) -> None:
    """Tell lines: on the terminal and in the log."""
    for line in lines:
        LOG.info(line)


def tell_moving(text: str) -> None:
    """Tell what is being done, on the terminal's moving line."""
    LOG.debug("%s", text, extra={"moving": True})
