"""Pictures of a finished folder, drawn by a child process: :func:`draw`, or ``python3 -m hvi_fenicsx.report.pictures``.

The child knows the folder alone, and no MPI: what goes wrong in it (VTK aborts where it finds no display) costs a
picture, never a run. Nothing here imports a plotting library; the child does.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import socket
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...runtime import manifest, processes, writing
from ..errors import PictureError

UNFINISHED = ".part.png"
"""How the name of a picture ends that is being written."""
PATIENCE = 3.0
"""Seconds for a child to end by itself."""
COMPLAINT = "pictures: "
"""How the child's message to its caller begins."""
WHEN_TOLD, TOLD = "--when-told", "draw\n"
"""The child's option to wait, and the line that ends it."""


@dataclass(frozen=True, kw_only=True)
class PictureProcess:
    """A process that has loaded what it draws with, or is about to, and waits until the folder can be drawn.

    Attributes:
        child: the process.
        line: to its standard input.
        folder: whose pictures it draws.
        command: by which they can be drawn again.
    """

    child: subprocess.Popen[str]
    line: socket.socket
    folder: Path
    command: str

    def begin(self) -> None:
        """Let it draw: the folder has all that pictures are drawn from. To say it again does nothing."""
        with contextlib.suppress(OSError):  # it has failed already: then `finish` tells
            # Without a signal: PETSc's handler of a broken pipe would end the whole program.
            self.line.send(TOLD.encode(), socket.MSG_NOSIGNAL)

    def finish(self, timeout: float) -> list[Path]:
        """Wait for the pictures.

        Args:
            timeout: seconds after which the process is given up.

        Returns:
            The pictures, as paths.

        Raises:
            PictureError: the process failed; its message says which picture and why.
            NotWrittenError: there is no room for a picture.
        """
        try:
            names, errors = self.child.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            raise PictureError(f"not drawn within {timeout:g} s; {self.command} tries again") from None
        writing.raise_handed_over(self.child.returncode, errors)
        if self.child.returncode != 0:
            raise PictureError(_message(errors, self.child.returncode))
        manifest.add(self.folder, names.splitlines())
        return [self.folder / name for name in names.splitlines()]


def draw(folder: Path, *, timeout: float = 120) -> list[Path]:
    """Draw all pictures of a result folder into it; for rank 0 alone.

    Args:
        folder: a finished result.
        timeout: seconds after which the child is ended.

    Returns:
        The pictures, as paths.

    Raises:
        PictureError: the child failed; its message says which picture and why.
        NotWrittenError: there is no room for a picture.
    """
    with waiting(folder) as process:
        process.begin()
        return process.finish(timeout)


@contextlib.contextmanager
def waiting(folder: Path, dimension: int = 2) -> Iterator[PictureProcess]:
    """Start what will draw, while the caller does something else; for rank 0 alone.

    At the end of the block it is gone, whether it has drawn or not.

    Args:
        folder: a result that will be finished.
        dimension: of its body; what draws it is loaded before the process is told, what only the other one needs after.

    Yields:
        The process.

    Raises:
        PictureError: there is no process for them.
    """
    command = [*processes.PYTHON, "-m", __package__, os.path.abspath(folder)]
    with contextlib.ExitStack() as stack:
        try:
            line, end = (stack.enter_context(one) for one in socket.socketpair())
            child = _child([*command, WHEN_TOLD, str(dimension)], Path(folder), end)
        except OSError as error:
            raise PictureError(f"no process draws: {error.strerror or error}") from None
        end.close()  # the child has it: there, the input ends where ours is closed
        stack.enter_context(_ended(child, Path(folder)))
        yield PictureProcess(child=child, line=line, folder=Path(folder), command=shlex.join(command))


def _child(command: Sequence[str], folder: Path, end: socket.socket) -> subprocess.Popen[str]:
    # One thread for linear algebra: the child forks, and what it draws needs none.
    alone = {**processes.environment(), "OMP_NUM_THREADS": "1"}
    pipes: dict[str, Any] = {"stdin": end, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    # In the result's folder: in the current one matplotlib would read a file of settings.
    return subprocess.Popen(command, env=alone, cwd=folder, start_new_session=True, **pipes)


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
