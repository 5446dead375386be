"""Solutions of a singular linear system within intervals: cells on which all tractions are straight."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from ..typing import Array


def is_singular(matrix: Array, condition: float) -> bool:
    """Whether a linear system has no solution, or many.

    Args:
        matrix: of the system, (n, n).
        condition: number beyond which it is singular.
    """
    return not np.linalg.cond(matrix) < condition


def some_solution(matrix: Array, right: Array, sides: Array) -> Array | None:
    """A solution of a singular linear system, halfway between two; None if there is none.

    Args:
        matrix: of the system, (n, n).
        right: its right side, (n,).
        sides: intervals, (n, 2).
    """
    size, n = float(np.abs(matrix).max()) or 1.0, len(right)
    ends = [
        linprog(np.full(n, sign), A_eq=matrix / size, b_eq=right / size, bounds=sides, method="highs")
        for sign in (1.0, -1.0)
    ]
    return None if any(e.status != 0 for e in ends) else np.asarray(0.5 * (ends[0].x + ends[1].x))
