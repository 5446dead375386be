"""The equations at a point of a curve with a row beside them, factorised: what is near to them is solved with it, too.

The row may be another one: its part of a solution lies along the one direction in which the equations stay satisfied.
Where a site passes to another segment, only its columns change: they are exchanged beside the factors (the product form
of the inverse, Dantzig and Orchard-Hays 1954).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ...typing import Array, Integers
from ..thresholds import DEFAULT, CurveThresholds


@dataclass(frozen=True, kw_only=True)
class _Exchange:
    """Columns that were exchanged.

    Attributes:
        columns: their numbers, (k,).
        spike: the new ones as combinations of those before, less the identity in their own places, (n + 1, k).
        own: the inverse of these combinations' part in their own places, (k, k).
    """

    columns: Integers
    spike: Array
    own: Array

    def applied(self, found: Array) -> Array:
        """A solution with the new columns from that with the old ones, (n + 1,)."""
        return np.asarray(found - self.spike @ (self.own @ found[self.columns]))


class Bordered:
    """The factors.

    Args:
        matrix: the equations, n rows, and the row, (n + 1, n + 1); overwritten if its columns are contiguous.
        thresholds: what costs digits.

    Attributes:
        along: the direction in which the equations stay satisfied, the row growing by 1, (n + 1,).

    Raises:
        numpy.linalg.LinAlgError: the matrix is singular.
    """

    def __init__(self, matrix: Array, thresholds: CurveThresholds = DEFAULT.curve) -> None:
        self._thresholds = thresholds
        self._row = matrix[-1].copy()
        self._exchanges: list[_Exchange] = []
        self._factors, self._pivots, singular = dgetrf(matrix, overwrite_a=1)
        if singular or not self._has_tangent():
            raise np.linalg.LinAlgError("the equations have no tangent here")

    def _has_tangent(self) -> bool:
        """Find the direction in which the equations stay satisfied; whether there is one."""
        self.along = self._solved(np.eye(1, len(self._row), len(self._row) - 1)[0])
        self._length = float(np.linalg.norm(self.along))
        return 0.5 < float(self._row @ self.along) < 2.0  # it is 1 where any digit is left

    def _solved(self, right: Array) -> Array:
        found = np.asarray(dgetrs(self._factors, self._pivots, right)[0])
        for exchange in self._exchanges:
            found = exchange.applied(found)
        return found

    def exchange(self, columns: Integers, values: Array) -> bool:
        """Put other columns into the equations; whether that went well. If not, the factors are good for nothing.

        Args:
            columns: their numbers, (k,).
            values: the new ones, (n, k).
        """
        if len(self._exchanges) == self._thresholds.exchanges:
            return False
        spike = np.stack([self._solved(np.append(v, self._row[i])) for i, v in zip(columns, values.T, strict=True)], 1)
        own = spike[columns]
        size = float(np.max(np.abs(spike)))
        if not np.isfinite(size) or np.linalg.svd(own, compute_uv=False)[-1] <= self._thresholds.across * size:
            return False
        spike[columns] -= np.eye(len(columns))
        self._exchanges.append(
            _Exchange(columns=columns, spike=spike, own=np.asarray(np.linalg.inv(own), dtype=np.float64))
        )
        return self._has_tangent() and self.takes(self._row)

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
        return abs(float(row @ self.along)) > self._thresholds.across * float(np.linalg.norm(row)) * self._length

    def step(self, left: Array, row: Array, value: float) -> Array:
        """The change that takes out what is left of the equations and of another row, (n + 1,).

        Args:
            left: of the equations, (n,).
            row: the row, (n + 1,).
            value: what is left of it.
        """
        found = self.across(left)
        return found + self.along * ((value - float(row @ found)) / float(row @ self.along))
