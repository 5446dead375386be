"""What commands share that write a folder: the ranks, the folder, its log, a request to stop, and what is told."""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mpi4py import MPI

from .. import console, results
from ..model import Model, dump_scene, read_scene
from ..report.page import NAME as PAGE
from ..results.output_folder import inputs_of, read_finished
from ..runtime import log, writing
from ..runtime.cost import Timer
from ..runtime.manifest import __version__
from ..runtime.mpi import on_root, stop_on_signals
from ..system import petsc_options

COMM = MPI.COMM_WORLD
LOG = log.logger("commands")
Record = dict[str, Any]
"""A summary."""


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

    def journal(self, name: str) -> list[writing.Record]:
        """What an unfinished result has left in a journal, if this call shall go on from it. Rank 0 only."""
        return writing.read_journal(self.folder.target / name, self.identity) if self.options.resume else []


def execute(
    options: argparse.Namespace,
    work: Callable[[Session], int],
    *,
    suffix: str,
    done: Callable[[Record], bool],
    changed: Callable[[Model], Model] = lambda scene: scene,
) -> int:
    """Have a command write its folder, unless that is finished already; the exit code. Collective.

    Args:
        options: the words of the command line.
        work: writes all files but ``run.log``, and gives the exit code (collective).
        suffix: what the default folder has behind the name of the scene.
        done: whether a summary is of what is asked for, and finished. Rank 0 only.
        changed: what the command makes of the scene.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    scene = changed(on_root(COMM, lambda: read_scene(options.scene, options.overrides)))
    target = on_root(COMM, lambda: results.resolved(options.out or Path("results") / f"{options.scene.stem}{suffix}"))
    if options.resume and (code := on_root(COMM, lambda: _finished(target, scene, done))) is not None:
        return code
    goes_on = options.force or options.resume
    with results.ResultFolder(COMM, target, force=goes_on, inputs=[options.scene]) as folder:
        interrupted, run_logs = stop_on_signals(COMM), list[log.RunLog]()
        on_root(COMM, lambda: run_logs.append(log.RunLog(folder.work / "run.log")))
        with display():
            with log.handled(*run_logs):
                code = work(Session(options, scene, folder, timer, interrupted))
            on_root(COMM, lambda: run_logs[0].finish())
            folder.commit(scene)
            say(console.warnings([*folder.kept, *petsc_options.unread(options.petsc)]))
            first = on_root(COMM, lambda: f"; open {PAGE} there" if (target / PAGE).is_file() else "")
            say([f"{target}: {timer.total:.1f} s in all{first}"])
    return int(code)


def _finished(target: Path, scene: Model, done: Callable[[Record], bool]) -> int | None:
    """The exit code of a finished result of the same scene, which is told; None where there is none. Rank 0 only."""
    record, fault = read_finished(target, scene)
    if fault is not None:
        log.say(f"{target}: {fault}; the scene is run again")
    if record is None or not done(record):
        return None
    log.say(f"{target}: finished already ({record['reason']})")
    return int(record["exit_code"])


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
