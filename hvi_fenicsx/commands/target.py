"""What commands that write a folder share: which folder it is, whether it is there already, and what is said of it."""

from __future__ import annotations

import argparse
import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from .. import results
from ..report.html.render import NAME as PAGE
from ..results.folder import inputs_of
from ..results.output_folder import existing
from ..runtime import terminal
from ..runtime.mpi import on_root
from ..runtime.timing import Timer
from ..runtime.versions import __version__
from ..scene import Scene, dump_scene
from .telling import COMM

Record = dict[str, Any]
"""A summary."""


def path_of(options: argparse.Namespace, suffix: str = "") -> Path:
    """The folder for the result, without symbolic links. Collective.

    Args:
        options: of the command.
        suffix: what the default has behind the name of the scene.

    Raises:
        InputError: on all ranks alike: its links go round in a circle.
    """
    default = Path("results") / f"{options.scene.stem}{suffix}"
    return on_root(COMM, lambda: results.resolved(options.out or default))


def opened(options: argparse.Namespace, target: Path) -> results.ResultFolder:
    """The folder, to be written. Collective.

    Args:
        options: of the command.
        target: the folder.

    Raises:
        InputError: on all ranks alike: it may not be written.
    """
    kept = existing(force=options.force or options.resume)
    return results.ResultFolder(COMM, target, kept, inputs=[options.scene])


def given(options: argparse.Namespace) -> dict[str, str]:
    """The command line and PETSc's options, for ``summary.json``."""
    return {"command": options.given, "petsc": options.petsc}


def finished(target: Path, scene: Scene, again: str, done: Callable[[Record], bool]) -> int | None:
    """The exit code of a finished result of the same scene, which is told; None where there is none. Collective.

    Args:
        target: the folder.
        scene: the scene.
        again: what is done where a result cannot be kept, for the line that says so.
        done: whether a summary is of what is asked for, and finished.
    """
    return on_root(COMM, lambda: _finished(target, scene, again, done))


def _finished(target: Path, scene: Scene, again: str, done: Callable[[Record], bool]) -> int | None:
    """Rank 0 only."""
    record, fault = results.finished.read(target, scene)
    if fault is not None:
        terminal.say(f"{target}: {fault}; {again}")
    if record is None or not done(record):
        return None
    terminal.say(f"{target}: finished already ({record['reason']})")
    return int(record["exit_code"])


def identity(scene: Scene, target: Path) -> str:
    """What an unfinished result depends on; on another number of ranks the unknowns have another order. Rank 0 only.

    Args:
        scene: the scene.
        target: the folder of the result.
    """
    parts = [__version__, COMM.size, dump_scene(scene, target), sorted(inputs_of(scene, target).items())]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def where(target: Path, timer: Timer) -> str:
    """The last line: where the result is, how long it took, and with what to begin. Collective.

    Args:
        target: the folder.
        timer: of the run.
    """
    first = on_root(COMM, lambda: f"; open {PAGE} there" if (target / PAGE).is_file() else "")
    return f"{target}: {timer.total:.1f} s in all{first}"
