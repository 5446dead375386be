"""The linear equations of points on straight segments, n for n coordinates and the factor, and a basis that is kept."""

from __future__ import annotations

import numpy as np
from typing_extensions import override

from ..reduced.condensed_stiffness import CellColumns, CellInverse
from ..typing import Array, Mask, magnitude
from .branch import Branch
from .contact_points import ContactPoints
from .rigid_motions import are_same, pins
from .thresholds import DEFAULT

FACTOR = -1
"""The number of the factor among the variables."""


class StraightEquations(Branch):
    """S x + r = f0 + λ f1 on the present segments; one of the n + 1 variables drives, the others form the basis.

    Args:
        points: where all points are; changed.
        constant: f0, (n,).
        rate: f1, (n,).
        z: their coordinates along the segments, (n,); of force where the displacement stands.
        factor: λ.

    Attributes:
        y: coordinates and factor, (n + 1,).
        rate: f1, (n,).
        driver: the variable that drives.
        column: the values of the basis that the driving variable's column has, (n,).
        held: rigid motions that nothing resists and no load drives, as orthonormal rows, (d, n).
    """

    def __init__(self, points: ContactPoints, constant: Array, rate: Array, z: Array, factor: float) -> None:
        self.points, self._constant, self.rate = points, constant, rate
        self._stiffness, self.y = points.elastic, np.append(z, factor)
        self._pins = np.zeros(len(z))
        self._resisting: Mask = np.empty(0, dtype=bool)
        self.held: Array = np.empty((0, len(z)))
        self.column: Array = np.empty(0)
        self.hold()

    @property
    @override
    def factor(self) -> float:
        return float(self.y[FACTOR])

    @property
    @override
    def z(self) -> Array:
        return self.y[:-1]

    def hold(self) -> bool:
        """Hold the motions that nothing resists and no load drives; whether they are others than before."""
        resisting = self.points.resisting(self.values) if len(self.points.rigid) else self._resisting
        if np.array_equal(resisting, self._resisting):
            return False
        self._resisting = resisting
        held = self.points.unresisted(self.values, self.rate).held
        if are_same(held, self.held):
            return False
        self.held, self._pins = held, np.zeros(len(self.z))
        self._pins[pins(held)] = self.points.stiffest or 1.0
        return True

    def residual(self) -> Array:
        """What is left of the forces, (n,)."""
        values = self.values
        return self._stiffness @ values.x + values.force - self._constant - self.factor * self.rate

    def _column_of(self, i: int) -> Array:
        """How the equations change with a variable, (n,)."""
        if i == FACTOR:
            return -self.rate
        if rise := self.points.rise[i]:
            return rise * np.eye(1, len(self.z), i)[0]
        found = self._stiffness.column(i)
        found[i] += self.points.slope[i] + self._pins[i]
        return found

    def _product(self, y: Array) -> Array:
        """The equations times all variables, (n,)."""
        points, z = self.points, y[:-1]
        diagonal = np.where(points.moving, points.slope + self._pins, points.rise)
        found = self._stiffness @ np.where(points.moving, z, 0.0)
        return found + diagonal * z - y[FACTOR] * self.rate

    def factorised(self, driver: int = FACTOR) -> CellInverse:
        """The inverse of the equations, the factor in the place of the variable that drives.

        Args:
            driver: that variable.

        Raises:
            numpy.linalg.LinAlgError: they are singular.
        """
        number, slope = None if driver == FACTOR else driver, self.points.slope + self._pins
        columns = CellColumns(slope=slope, rise=self.points.rise, driver=number, factor=-self.rate)
        return self._stiffness.inverse(columns)

    def drive(self, driver: int, inverse: CellInverse | None = None) -> None:
        """Let a variable drive.

        Args:
            driver: the variable.
            inverse: of the equations, where it is known and the factor drives.

        Raises:
            numpy.linalg.LinAlgError: the equations are singular.
        """
        self.driver = driver
        self._inverse = self.factorised(driver) if inverse is None or driver != FACTOR else inverse.copy()

    def renew(self) -> None:
        """Find :attr:`column` for the present segments; factorised anew where the inverse has lost digits."""
        right = self._column_of(self.driver)
        if self._inverse.is_long:
            self._inverse = self.factorised(self.driver)
        for _ in range(2):
            found = self.solved(right)
            left = right - self._product(self.variables(found))
            if magnitude(left) <= DEFAULT.slow * magnitude(right):
                break
            self._inverse = self.factorised(self.driver)
        self.column = found + self.solved(left)

    def solved(self, right: Array) -> Array:
        """The values that the basis takes to a column but for rounding, (n,).

        Args:
            right: the column, (n,).
        """
        return self._inverse.solve(right)

    def variables(self, values: Array) -> Array:
        """The values of the basis by variable, 0 of the one that drives, in whose place is the factor, (n + 1,).

        Args:
            values: of the basis, (n,).
        """
        found = np.zeros(len(values) + 1)
        found[:-1] = values
        found[FACTOR], found[self.driver] = found[self.driver], 0.0
        return found

    def replace(self, changed: int) -> int:
        """Put the column of a coordinate on its new segment in the place of its old one; the same variable drives.

        Args:
            changed: number of its point.

        Returns:
            0 where that, or an exchange, costs no fewer digits: nothing is done; else the direction in which the
            driving variable goes on, relative to before, for the coordinate to go on as it did.
        """
        if _strength(self.column, changed) >= DEFAULT.small:
            return 0
        spread = self.solved(self._column_of(changed))
        if _strength(spread, changed) < DEFAULT.small:
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

    @override
    def inverse(self) -> CellInverse | None:
        found, rate = self._inverse.copy(), self.rate
        with np.errstate(all="ignore"):
            if self.driver != FACTOR:
                found.exchange(self.column, self.driver)
            left = self._product(np.append(found.solve(rate), 0.0)) - rate
            known = magnitude(left) <= DEFAULT.slow * magnitude(rate)
        return found if known else None


def _strength(column: Array, place: int) -> float:
    """The pivot at a place over the largest entry of its column."""
    return float(abs(column[place])) / (magnitude(column) or 1.0)
