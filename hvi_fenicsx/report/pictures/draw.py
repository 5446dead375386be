"""Pictures of a finished folder, drawn by a child process: :func:`draw`, or ``python3 -m hvi_fenicsx.report.pictures``.

The child knows the folder alone, and no MPI: what goes wrong in it (VTK aborts where it finds no display) costs a
picture, never a run. Nothing here imports a plotting library; the child does.
"""

from __future__ import annotations

import contextlib
import functools
import os
import shlex
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from ...runtime import manifest, processes
from ..errors import PictureError

UNFINISHED = ".part.png"
"""How the name of a picture ends that is being written."""
PATIENCE = 3.0
"""Seconds for a child to end by itself."""
COMPLAINT = "pictures: "
"""How the child's message to its caller begins."""


def draw(folder: Path, *, timeout: float = 120) -> list[Path]:
    """Draw all pictures of a result folder into it; for rank 0 alone.

    Args:
        folder: a finished result.
        timeout: seconds after which the child is ended.

    Returns:
        The pictures, as paths.

    Raises:
        PictureError: the child failed; its message says which picture and why.
    """
    with drawing(folder) as finish:
        return finish(timeout)


@contextlib.contextmanager
def drawing(folder: Path) -> Iterator[Callable[[float], list[Path]]]:
    """Draw while the caller does something else; for rank 0 alone.

    Args:
        folder: a finished result.

    Yields:
        Waits for the pictures so many seconds, and returns or raises what :func:`draw` does.

    Raises:
        PictureError: there is no process for them.
    """
    command = [*processes.PYTHON, "-m", __package__, os.path.abspath(folder)]
    # One thread for linear algebra: the child forks, and what it draws needs none.
    alone = {**processes.environment(), "OMP_NUM_THREADS": "1"}
    # In the result's folder: in the current one matplotlib would read a file of settings.
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    try:
        child = subprocess.Popen(command, env=alone, cwd=folder, start_new_session=True, **pipes)
    except OSError as error:
        raise PictureError(f"no process draws: {error.strerror or error}") from None
    with _ended(child, Path(folder)):
        yield functools.partial(_pictures, child, Path(folder), shlex.join(command))


def _pictures(child: subprocess.Popen[str], folder: Path, command: str, timeout: float) -> list[Path]:
    """What the child has drawn."""
    try:
        names, errors = child.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        raise PictureError(f"not drawn within {timeout:g} s; {command} tries again") from None
    if child.returncode != 0:
        raise PictureError(_message(errors, child.returncode))
    try:
        manifest.add(folder, names.splitlines())
    except OSError as error:
        raise PictureError(f"{folder}/{manifest.NAME}: cannot be written: {error.strerror or error}") from None
    return [folder / name for name in names.splitlines()]


@contextlib.contextmanager
def _ended(child: subprocess.Popen[str], folder: Path) -> Iterator[None]:
    """Whatever happens, of the child nothing remains: no process (it leads a group), no half-written file."""
    try:
        yield
    finally:
        if child.returncode != 0:
            processes.end(child, PATIENCE)
            for file in folder.glob(f".*{UNFINISHED}"):
                file.unlink(missing_ok=True)


def _message(errors: str, code: int) -> str:
    """The child's own words are the lines that begin so; before them there may be a library's noise."""
    own = [line.removeprefix(COMPLAINT) for line in errors.splitlines() if line.startswith(COMPLAINT)]
    noise = errors.strip().splitlines()[-1:]
    return "; ".join(own or [f"the drawing process ended with {code}", *noise])
