"""A state of points on straight segments: its coordinates, its linear equations, and a basis of them that is kept."""

from __future__ import annotations

import numpy as np

from ..reduced.condensed_stiffness import CellColumns, CellInverse
from ..typing import Array
from .relations import ContactPoints, Values
from .rigid_motions import are_same, pins
from .thresholds import DEFAULT


class StraightState:
    """All n points on their segments.

    Args:
        points: the points, all of them straight; their statuses are changed by :meth:`enter`.
        tau: the coordinates along the segments, (n,); of force where the displacement stands.

    Attributes:
        points: as given.
        tau: the coordinates.
        held: rigid motions that nothing resists and no load drives, as orthonormal rows, (d, n).
    """

    def __init__(self, points: ContactPoints, tau: Array) -> None:
        self.points, self.tau, self._stiffness = points, np.array(tau), points.elastic
        self.held: Array = np.empty((0, len(tau)))
        self._pins = np.zeros(len(tau))

    def __len__(self) -> int:
        return len(self.tau)

    @property
    def values(self) -> Values:
        """Displacements and forces."""
        return self.points.values(self.tau)

    def enter(self, i: int, number: int, coordinate: float) -> None:
        """Put a point on a segment.

        Args:
            i: the point.
            number: of the segment.
            coordinate: τ there.
        """
        self.points.enter(i, number)
        self.tau[i] = coordinate

    @property
    def tangent(self) -> Array:
        """The slopes of the forces of laws and of what pins the body, (n,)."""
        return np.asarray(self.points.slope + self._pins)

    def column(self, i: int) -> Array:
        """How the equations change with a coordinate, (n,)."""
        rise = self.points.rise[i]
        if rise:
            return np.asarray(rise * np.eye(1, len(self), i)[0])
        found = self._stiffness.column(i)
        found[i] += self.tangent[i]
        return found

    def hold(self, rate: Array) -> bool:
        """Hold the motions that nothing resists and no load drives; whether they are others than before.

        Args:
            rate: the load that grows, (n,).
        """
        if not len(self.points.rigid):
            return False
        held = self.points.unresisted(self.values, rate).held
        if are_same(held, self.held):
            return False
        self.held, self._pins = held, np.zeros(len(self))
        self._pins[pins(held)] = self.points.stiffest or 1.0
        return True

    def inverse(self, driver: int | None = None, factor: Array | None = None) -> CellInverse:
        """The inverse of the equations.

        Args:
            driver: the point in whose place is the factor; None: all are in their own places.
            factor: the factor's column, (n,).

        Raises:
            numpy.linalg.LinAlgError: they are singular.
        """
        column = np.zeros(len(self)) if factor is None else factor
        given = CellColumns(slope=self.tangent, rise=self.points.rise, driver=driver, factor=column)
        return self._stiffness.inverse(given)

    def product(self, coordinates: Array) -> Array:
        """The equations times coordinates, (n,).

        Args:
            coordinates: (n,).
        """
        moving = self.points.moving
        found = self._stiffness @ np.where(moving, coordinates, 0.0)
        return np.asarray(found + np.where(moving, self.tangent, self.points.rise) * coordinates)


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
        if not np.max(np.abs(left), initial=0.0) <= DEFAULT.slow * np.max(np.abs(right), initial=0.0):
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
        if _strength(self.column, changed) >= DEFAULT.small:
            return 0
        spread = self.roughly(self._state.column(changed))
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

    def inverse(self) -> CellInverse | None:
        """The inverse of the equations with the factor driving; None where it is not known to enough digits."""
        found = self._inverse.copy()
        with np.errstate(all="ignore"):
            if self.driver != FACTOR:
                found.exchange(self.column, self.driver)
            left = self._product(found.solve(self._rate), FACTOR) - self._rate
            allowed = DEFAULT.slow * np.max(np.abs(self._rate), initial=0.0)
            known = bool(np.max(np.abs(left), initial=0.0) <= allowed)
        return found if known else None


def _strength(column: Array, place: int) -> float:
    """The pivot at a place over the largest entry of its column."""
    return float(abs(column[place])) / (float(np.max(np.abs(column))) or 1.0)
