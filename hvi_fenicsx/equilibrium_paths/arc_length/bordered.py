"""The equations at a point of a curve with a row beside them, factorised: what is near to them is solved with it, too.

The row may be another one: its part of a solution lies along the one direction in which the equations stay satisfied.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ...typing import Array

_ACROSS = 1e-3
"""A row that hardly changes along the direction, beside its size, costs digits: it wants factors of its own."""


class Bordered:
    """The factors.

    Args:
        matrix: the equations, n rows, and the row, (n + 1, n + 1); overwritten if its columns are contiguous.

    Attributes:
        along: the direction in which the equations stay satisfied, the row growing by 1, (n + 1,).

    Raises:
        numpy.linalg.LinAlgError: the matrix is singular.
    """

    def __init__(self, matrix: Array) -> None:
        row = matrix[-1].copy()
        self._factors, self._pivots, singular = dgetrf(matrix, overwrite_a=1)
        if not singular:
            self.along = self._solved(np.eye(1, len(matrix), len(matrix) - 1)[0])
        if singular or not 0.5 < float(row @ self.along) < 2.0:  # it is 1 where any digit is left
            raise np.linalg.LinAlgError("the equations have no tangent here")
        self._length = float(np.linalg.norm(self.along))

    def _solved(self, right: Array) -> Array:
        return np.asarray(dgetrs(self._factors, self._pivots, right)[0])

    def across(self, left: Array) -> Array:
        """The change of the variables that takes out what is left of the equations and keeps the row, (n + 1,).

        Args:
            left: what is left, (n,).
        """
        return self._solved(np.append(left, 0.0))

    def takes(self, row: Array) -> bool:
        """Whether another row can stand beside the equations.

        Args:
            row: the row, (n + 1,).
        """
        return abs(float(row @ self.along)) > _ACROSS * float(np.linalg.norm(row)) * self._length

    def step(self, left: Array, row: Array, value: float) -> Array:
        """The change that takes out what is left of the equations and of another row, (n + 1,).

        Args:
            left: of the equations, (n,).
            row: the row, (n + 1,).
            value: what is left of it.
        """
        found = self.across(left)
        return found + self.along * ((value - float(row @ found)) / float(row @ self.along))
