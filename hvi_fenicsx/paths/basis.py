"""The basis of linear equations: the columns of all variables but the one that drives, inverted.

The variables are the coordinates of the points and the factor. Where one of them enters and another leaves, one
column is exchanged; what the inverse leaves of a column says when it has lost digits.
"""

from __future__ import annotations

import numpy as np

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array
from .straight_state import StraightState

FACTOR = -1
"""The number of the factor among the variables."""


class Basis:
    """The basis of a state's equations.

    Args:
        state: where all points are; changed from outside.
        rate: f1, (n,).
        driver: the variable that drives.
        inverse: of the equations, where it is known and the factor drives.

    Attributes:
        driver: the variable that drives.
        column: the values of the basis that the driving variable's column has, (n,).

    Raises:
        numpy.linalg.LinAlgError: the tangent is singular.
    """

    def __init__(self, state: StraightState, rate: Array, driver: int, inverse: CellInverse | None = None) -> None:
        self._thresholds = state.points.thresholds
        self._state, self._rate, self.driver = state, rate, driver
        if inverse is None or driver != FACTOR:
            self._factorise()
        else:
            self._inverse = inverse.copy()
        self.column: Array = np.empty(0)

    def _factorise(self) -> None:
        driver = None if self.driver == FACTOR else self.driver
        self._inverse = self._state.inverse(driver, -self._rate)

    def renew(self) -> None:
        """Find :attr:`column` for the present segments."""
        if self._inverse.is_long:
            self._factorise()
        self.column = self._solved(-self._rate if self.driver == FACTOR else self._state.column(self.driver))

    def _solved(self, right: Array) -> Array:
        """The values that the basis takes to a column, (n,); factorised anew where the inverse has lost digits."""
        found = self.roughly(right)
        left = right - self._product(found, self.driver)
        if not np.max(np.abs(left), initial=0.0) <= self._thresholds.slow * np.max(np.abs(right), initial=0.0):
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
        if driver == FACTOR:
            return self._state.product(values)
        coordinates = values.copy()
        coordinates[driver] = 0.0
        return np.asarray(self._state.product(coordinates) - values[driver] * self._rate)

    def replace(self, changed: int) -> int:
        """Put the column of a coordinate on its new segment in the place of its old one; the same variable drives.

        Args:
            changed: number of its point.

        Returns:
            0 where that, or an exchange, costs no fewer digits: nothing is done; else the direction in which the
            driving variable goes on, relative to before, for the coordinate to go on as it did.
        """
        if _strength(self.column, changed) >= self._thresholds.small:
            return 0
        spread = self.roughly(self._state.column(changed))
        if _strength(spread, changed) < self._thresholds.small:
            return 0
        self._inverse.exchange(spread, changed)
        return 1 if spread[changed] > 0.0 else -1

    def exchange(self, leaving: int) -> None:
        """Let the driving variable enter, and a coordinate leave, which drives from now on.

        Args:
            leaving: number of its point.
        """
        self._inverse.exchange(self.column, leaving)
        if self.driver != FACTOR:
            self._inverse.swap(leaving, self.driver)
        self.driver = leaving

    def inverse(self) -> CellInverse | None:
        """The inverse of the equations with the factor driving; None where it is not known to enough digits."""
        found = self._inverse.copy()
        with np.errstate(all="ignore"):
            if self.driver != FACTOR:
                found.exchange(self.column, self.driver)
            left = self._product(found.solve(self._rate), FACTOR) - self._rate
            allowed = self._thresholds.slow * np.max(np.abs(self._rate), initial=0.0)
            known = bool(np.max(np.abs(left), initial=0.0) <= allowed)
        return found if known else None


def _strength(column: Array, place: int) -> float:
    """The pivot at a place over the largest entry of its column."""
    return float(abs(column[place])) / (float(np.max(np.abs(column))) or 1.0)
