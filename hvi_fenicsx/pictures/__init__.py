"""Pictures of a finished result folder, drawn by a child process: :func:`draw`, or ``python3 -m hvi_fenicsx.pictures``.

The child knows the folder alone, and no MPI: what goes wrong in it (VTK aborts where it finds no display) costs a
picture, never a run. Nothing here imports a plotting library; the child does.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from ..errors import HviError

UNFINISHED = ".part.png"
"""How the name of a picture ends that is being written."""
PATIENCE = 3.0
"""Seconds for a child to end by itself."""
COMPLAINT = "pictures: "
"""How the child's message to its caller begins."""
_MPI = ("OMPI_", "PMIX_", "PRTE_", "PMI_", "HYDRA_", "MPI_LOCAL")


class PictureError(HviError):
    """A picture could not be drawn; those that could are in the folder."""


def draw(folder: Path, *, timeout: float = 120) -> list[Path]:
    """Draw all pictures of a result folder into it; for rank 0 alone.

    Args:
        folder: a result (design.md, the contract). timeout: seconds after which the child is ended.

    Returns:
        The pictures, as paths.

    Raises:
        PictureError: the child failed; its message says which picture and why.
    """
    command = [sys.executable, "-m", __name__, os.fspath(folder)]
    child = subprocess.Popen(
        command, env=_environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    with _ended(child, Path(folder)):
        try:
            names, errors = child.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            raise PictureError(f"not drawn within {timeout:g} s; {' '.join(command)} tries again") from None
    if child.returncode != 0:
        raise PictureError(_message(errors, child.returncode))
    return [Path(folder) / name for name in names.splitlines()]


def _environment() -> dict[str, str]:
    """Ours, without what would make the child believe that it is a rank, and with this package on its path.

    One thread for linear algebra: the child forks, and what it draws needs none.
    """
    kept = {name: value for name, value in os.environ.items() if not name.startswith(_MPI)}
    paths = [str(Path(__file__).parents[2]), kept.get("PYTHONPATH", "")]
    return {**kept, "OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(filter(None, paths))}


@contextlib.contextmanager
def _ended(child: subprocess.Popen[str], folder: Path) -> Iterator[None]:
    """Whatever happens, of the child nothing remains: no process (it leads a group), no half-written file."""
    try:
        yield
    finally:
        if child.returncode != 0:
            _end(child)
            for file in folder.glob(f".*{UNFINISHED}"):
                file.unlink(missing_ok=True)


def _end(child: subprocess.Popen[str]) -> None:
    """Politely first, so that an X server takes its socket with it."""
    for order in (signal.SIGTERM, signal.SIGKILL):
        with contextlib.suppress(OSError):
            os.killpg(child.pid, order)
        with contextlib.suppress(subprocess.TimeoutExpired):
            child.communicate(timeout=PATIENCE)


def _message(errors: str, code: int) -> str:
    """The child's own words are the lines that begin so; before them there may be a library's noise."""
    own = [line.removeprefix(COMPLAINT) for line in errors.splitlines() if line.startswith(COMPLAINT)]
    noise = errors.strip().splitlines()[-1:]
    return "; ".join(own or [f"the drawing process ended with {code}", *noise])


__all__ = ["PictureError", "draw"]
