"""The start of PETSc, and of MPI with it, by a command."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path


def start() -> None:
    """Start PETSc without its signal handlers, and without the options in a ``.petscrc`` of the current folder.

    Its handlers would end the program for a broken pipe or a closed terminal. Where PETSc runs already, nothing
    happens. Children inherit the same. Options in the home folder and in PETSC_OPTIONS are the user's, and hold.
    """
    given = os.environ.get("PETSC_OPTIONS", "")
    if "-no_signal_handler" not in given.split():
        os.environ["PETSC_OPTIONS"] = f"{given} -no_signal_handler".strip()
    with contextlib.chdir(Path(__file__).parent):
        from petsc4py import PETSc  # noqa: F401  (its import starts it)
