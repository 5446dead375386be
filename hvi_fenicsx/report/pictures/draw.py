"""Pictures of a finished folder, drawn by a child process: ``python3 -m hvi_fenicsx.report.pictures.drawings``.

The child knows the folder alone, and no MPI: what goes wrong in it (VTK aborts where it finds no display) costs a
picture, never a run. Nothing here imports a plotting library; the child does.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import subprocess
from collections.abc import Iterator
from pathlib import Path

from ...runtime import manifest, processes, writing
from ..solution_arrays import ReportError

UNFINISHED = ".png.part"
"""How the name of a picture ends that is being written."""
COMPLAINT = "pictures: "
"""How the child's message to its caller begins."""


class PictureError(ReportError):
    """A picture could not be drawn; those that could are in the folder."""


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
    command = [*processes.PYTHON, "-m", f"{__package__}.drawings", os.path.abspath(folder)]
    with _child(command, folder) as child:
        try:
            names, errors = child.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            raise PictureError(f"not drawn within {timeout:g} s; {shlex.join(command)} tries again") from None
    writing.raise_handed_over(child.returncode, errors)
    if child.returncode != 0:
        raise PictureError(_message(errors, child.returncode))
    manifest.add(folder, names.splitlines())
    return [folder / name for name in names.splitlines()]


@contextlib.contextmanager
def _child(command: list[str], folder: Path) -> Iterator[subprocess.Popen[str]]:
    """What draws; whatever happens, of it nothing remains: no process (it leads a group), no half-written file."""
    # One thread for linear algebra: the child forks, and what it draws needs none.
    alone, pipe = {**processes.environment(), "OMP_NUM_THREADS": "1"}, subprocess.PIPE
    try:  # in the result's folder: in the current one matplotlib would read a file of settings
        child = subprocess.Popen(
            command, env=alone, cwd=folder, start_new_session=True, stdin=subprocess.DEVNULL,
            stdout=pipe, stderr=pipe, text=True,
        )  # fmt: skip
    except OSError as error:
        raise PictureError(f"no process draws: {error.strerror or error}") from None
    try:
        yield child
    finally:
        if child.returncode != 0:
            processes.end(child)
            for file in folder.glob(f".*{UNFINISHED}"):
                file.unlink(missing_ok=True)


def _message(errors: str, code: int) -> str:
    """The child's own words are the lines that begin so; before them there may be a library's noise."""
    own = [line.removeprefix(COMPLAINT) for line in errors.splitlines() if line.startswith(COMPLAINT)]
    noise = errors.strip().splitlines()[-1:]
    return "; ".join(own or [f"the drawing process ended with {code}", *noise])
