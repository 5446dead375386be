"""``equilibria.png``: drawn by a child process, ``python3 -m hvi_fenicsx.report.pictures.equilibria_chart FOLDER``."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from ...runtime import processes, writing
from ..errors import PictureError

NAME = "equilibria.png"
TIMEOUT = 120.0
"""Seconds after which the child is ended."""


def draw(folder: Path) -> None:
    """Draw the picture of a folder of ``hvi equilibria`` that is being written. Rank 0 only.

    Args:
        folder: with ``equilibria.csv`` and the folders it names.

    Raises:
        PictureError: the child failed.
        NotWrittenError: there is no room for it.
    """
    command = [*processes.PYTHON, "-m", f"{__name__}_chart", os.path.abspath(folder)]
    try:
        done = subprocess.run(
            command, env=processes.environment(), cwd=folder, capture_output=True, text=True, timeout=TIMEOUT
        )
    except subprocess.TimeoutExpired:
        raise PictureError(f"{NAME}: not drawn within {TIMEOUT:g} s") from None
    writing.raise_handed_over(done.returncode, done.stderr)
    if done.returncode != 0:
        raise PictureError(f"{NAME}: {(done.stderr.strip() or '?').splitlines()[-1]}")
