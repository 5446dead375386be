"""The basis of the linear equations of one cell: the columns of all variables but the one that drives, inverted.

The variables are the coordinates of the unknowns and the factor. Where one of them enters and another leaves, one
column is exchanged; what the inverse leaves of a column says when it has lost digits.
"""

from __future__ import annotations

import numpy as np

from ..reduced.condensed_stiffness import CellInverse, CondensedStiffness
from ..typing import Array
from .cells import Cells
from .step import FACTOR
from .thresholds import ExactThresholds


class Basis:
    """The basis of a cell.

    Args:
        stiffness: S.
        rate: f1, (n,).
        cells: where all unknowns are; changed from outside.
        driver: the variable that drives.
        inverse: of the cell's equations, where it is known and the factor drives.
        thresholds: what costs digits.

    Attributes:
        driver: the variable that drives.
        column: the values of the basis that the driving variable's column has, (n,).

    Raises:
        numpy.linalg.LinAlgError: the tangent is singular.
    """

    def __init__(
        self,
        stiffness: CondensedStiffness,
        rate: Array,
        cells: Cells,
        driver: int,
        inverse: CellInverse | None,
        thresholds: ExactThresholds,
    ) -> None:
        self._thresholds = thresholds
        self._stiffness, self._rate, self._cells, self.driver = stiffness, rate, cells, driver
        if inverse is None or driver != FACTOR:
            self._factorise()
        else:
            self._inverse = inverse.copy()
        self.column: Array = np.empty(0)

    def _factorise(self) -> None:
        driver = None if self.driver == FACTOR else self.driver
        self._inverse = self._stiffness.inverse(self._cells.columns(driver, -self._rate))

    def renew(self) -> None:
        """Find :attr:`column` in the present cell."""
        if self._inverse.is_long:
            self._factorise()
        self.column = self._solved(-self._rate if self.driver == FACTOR else self._cells.column(self.driver))

    def _solved(self, right: Array) -> Array:
        """The values that the basis takes to a column, (n,); factorised anew where the inverse has lost digits."""
        found = self.roughly(right)
        left = right - self._product(found, self.driver)
        if not np.max(np.abs(left), initial=0.0) <= self._thresholds.kept * np.max(np.abs(right), initial=0.0):
            self._factorise()
            found = self.roughly(right)
            left = right - self._product(found, self.driver)
        return found + self.roughly(left)

    def roughly(self, right: Array) -> Array:
        """The same without refinement, (n,).

        Args:
            right: a column, (n,).
        """
        return self._inverse.solve(right)

    def _product(self, values: Array, driver: int) -> Array:
        """The basis times values: of the coordinates, and of the factor in the place of the one that drives, (n,)."""
        cells, moving, coordinates = self._cells, self._cells.moving, values.copy()
        if driver != FACTOR:
            coordinates[driver] = 0.0
        found = self._stiffness @ np.where(moving, coordinates, 0.0)
        found += np.where(moving, cells.tangent, cells.rise) * coordinates
        return np.asarray(found if driver == FACTOR else found - values[driver] * self._rate)

    def replace(self, changed: int) -> int:
        """Put the column of a coordinate in its new segment in the place of its old one; the same variable drives.

        Args:
            changed: number of its unknown.

        Returns:
            0 where that, or an exchange, costs no fewer digits: nothing is done; else the direction in which the
            driving variable goes on, relative to before, for the coordinate to go on as it did.
        """
        if _strength(self.column, changed) >= self._thresholds.weak:
            return 0
        spread = self.roughly(self._cells.column(changed))
        if _strength(spread, changed) < self._thresholds.weak:
            return 0
        self._inverse.exchange(spread, changed)
        return 1 if spread[changed] > 0.0 else -1

    def exchange(self, leaving: int) -> None:
        """Let the driving variable enter, and a coordinate leave, which drives from now on.

        Args:
            leaving: number of its unknown.
        """
        self._inverse.exchange(self.column, leaving)
        if self.driver != FACTOR:
            self._inverse.swap(leaving, self.driver)
        self.driver = leaving

    def inverse(self) -> CellInverse | None:
        """The inverse of the cell's equations with the factor driving; None where it is not known to enough digits."""
        found = self._inverse.copy()
        with np.errstate(all="ignore"):
            if self.driver != FACTOR:
                found.exchange(self.column, self.driver)
            left = self._product(found.solve(self._rate), FACTOR) - self._rate
            allowed = self._thresholds.kept * np.max(np.abs(self._rate), initial=0.0)
            known = bool(np.max(np.abs(left), initial=0.0) <= allowed)
        return found if known else None


def _strength(column: Array, place: int) -> float:
    """The pivot at a place over the largest entry of its column."""
    return float(abs(column[place])) / (float(np.max(np.abs(column))) or 1.0)
