"""Errors of Python functions that PETSc calls: it hands them on as its own, and a failed solve must not hide them."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

_OF_SOLVES = (PETSc.Error, ArithmeticError, np.linalg.LinAlgError)
"""What a solve from a bad start may end with: PETSc's own errors, overflow, singular matrices."""


def raise_python_error(error: PETSc.Error) -> None:
    """Raise what a Python function has raised within a solve; nothing where the solve itself has failed.

    A request to stop at once is such an error, and a mistake in a law or in this program.

    Args:
        error: of the solve.

    Raises:
        BaseException: that of the function.
    """
    cause: BaseException | None = error
    while isinstance(cause, PETSc.Error):
        cause = cause.__cause__
    if cause is not None and not isinstance(cause, _OF_SOLVES):
        raise cause
