"""What commands share that write a folder: the ranks, the folder, its log, a request to stop, and what is told."""

from __future__ import annotations

import argparse
import hashlib
import json
import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from mpi4py import MPI

from .. import console, results
from ..model import Model, dump_scene, read_scene
from ..report.page import NAME as PAGE
from ..results.output_folder import existing, inputs_of, read_finished
from ..runtime import log
from ..runtime.cost import Timer
from ..runtime.manifest import __version__
from ..runtime.mpi import on_root, stop_on_signals
from ..system import petsc_options

COMM = MPI.COMM_WORLD
LOG = log.logger("commands")
H = TypeVar("H", bound=logging.Handler)
Record = dict[str, Any]
"""A summary."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command that writes a folder.

    Attributes:
        suffix: what the default folder has behind the name of the scene.
        again: what is done where a result cannot be kept, for the line that says so.
        done: whether a summary is of what is asked for, and finished.
    """

    suffix: str
    again: str
    done: Callable[[Record], bool]


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
    def given(self) -> dict[str, str]:
        """The command line and PETSc's options, for ``summary.json``."""
        return {"command": self.options.given, "petsc": self.options.petsc}

    @property
    def identity(self) -> str:
        """What an unfinished result depends on; on other ranks the unknowns have another order. Rank 0 only."""
        target = self.folder.target
        parts = [__version__, COMM.size, dump_scene(self.scene, target), sorted(inputs_of(self.scene, target).items())]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def scene_of(options: argparse.Namespace) -> Model:
    """The scene, with PETSc's options set. Collective.

    Args:
        options: of the command.

    Raises:
        InputError: on all ranks alike.
    """
    petsc_options.insert(options.petsc)
    return on_root(COMM, lambda: read_scene(options.scene, options.overrides))


def execute(
    options: argparse.Namespace, scene: Model, command: Command, timer: Timer, work: Callable[[Session], int]
) -> int:
    """Have a command write its folder, unless that is finished already; the exit code. Collective.

    Args:
        options: the words of the command line.
        scene: what it is of.
        command: the command.
        timer: where time goes.
        work: writes all files but ``run.log``, and gives the exit code (collective).

    Raises:
        InputError: on all ranks alike.
    """
    default = Path("results") / f"{options.scene.stem}{command.suffix}"
    target = on_root(COMM, lambda: results.resolved(options.out or default))
    if options.resume and (code := on_root(COMM, lambda: _finished(target, scene, command))) is not None:
        return code
    kept = existing(force=options.force or options.resume)
    with results.ResultFolder(COMM, target, kept, inputs=[options.scene]) as folder:
        interrupted = stop_on_signals(COMM)
        run_logs = on_first_rank(lambda: log.RunLog(folder.work / "run.log"))
        with log.handled(*on_first_rank(log.TerminalDisplay)):
            with log.handled(*run_logs):
                code = work(Session(options, scene, folder, timer, interrupted))
            on_root(COMM, lambda: _finish(run_logs))
            folder.commit(scene)
            say(console.warnings([*folder.kept, *petsc_options.unread(options.petsc)]))
            first = on_root(COMM, lambda: f"; open {PAGE} there" if (target / PAGE).is_file() else "")
            say([f"{target}: {timer.total:.1f} s in all{first}"])
    return int(code)


def _finished(target: Path, scene: Model, command: Command) -> int | None:
    """The exit code of a finished result of the same scene, which is told; None where there is none. Rank 0 only."""
    record, fault = read_finished(target, scene)
    if fault is not None:
        log.say(f"{target}: {fault}; {command.again}")
    if record is None or not command.done(record):
        return None
    log.say(f"{target}: finished already ({record['reason']})")
    return int(record["exit_code"])


def on_first_rank(make: Callable[[], H]) -> list[H]:
    """The handler that rank 0 makes, none on the others. Collective."""
    made: list[H] = []
    on_root(COMM, lambda: made.append(make()))
    return made


def _finish(run_logs: Iterable[log.RunLog]) -> None:
    """Close logs; an error of writing is raised. Rank 0 only."""
    for run_log in run_logs:
        run_log.finish()


def say(lines: Iterable[str]) -> None:
    """Tell lines: on the terminal and in the log."""
    for line in lines:
        LOG.info(line)


def tell_moving(text: str, *values: object) -> None:
    """Tell what is being done, on the terminal's moving line.

    Args:
        text: with the places of the values, as for logging.
        *values: these.
    """
    LOG.debug(text, *values, extra={"moving": True})
