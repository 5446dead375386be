"""The direction in which a cell is softest, by Lanczos' method on its inverse."""

from __future__ import annotations

import numpy as np
from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array, Integers
from .cells import Cells


def softest(cells: Cells, inverse: CellInverse, start: Array, accuracy: float) -> Array:
    """The eigenvector of the negative eigenvalue next to zero, or else of the greatest one, zero where unknowns stand.

    Args:
        cells: the cell.
        inverse: of its equations.
        start: where the iteration begins, (n,).
        accuracy: relative.
    """
    found, free = np.zeros(len(cells)), np.flatnonzero(cells.moving)
    begin = inverse.solve(_spread(start[free], free, len(cells)))[free]
    if free.size < 2 or not np.any(begin):
        found[free] = begin if np.any(begin) else 1.0
        return found

    def response(v: Array) -> Array:
        return inverse.solve(_spread(v, free, len(cells)))[free]

    operator = LinearOperator((free.size, free.size), matvec=response, dtype=np.float64)
    try:
        found[free] = eigsh(operator, k=1, which="SA", v0=begin, tol=accuracy)[1][:, 0]
    except ArpackNoConvergence:
        found[free] = begin
    return found


def _spread(values: Array, free: Integers, size: int) -> Array:
    found = np.zeros(size)
    found[free] = values.ravel()
    return found
