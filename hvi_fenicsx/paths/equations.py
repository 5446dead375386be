"""The equations of a curve of equilibria in coordinates and factor: tangent, and points that satisfy a condition."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import override

from ..reduced.condensed_stiffness import by_factors
from ..typing import Array, Integers, magnitude
from .branch import Branch, Refused
from .contact_points import ContactPoints, Values
from .rigid_motions import are_same
from .thresholds import DEFAULT


@dataclass(frozen=True, kw_only=True)
class CurvePoint:
    """A point of the curve.

    Attributes:
        y: coordinates, and the factor in its unit, (n + 1,).
        tangent: of length 1, (n + 1,).
        values: of the points.
        left: of the forces, in their units, (n,).
    """

    y: Array
    tangent: Array
    values: Values
    left: Array


Condition = tuple[Callable[[Array], float], Callable[[Array], Array]]
"""What a corrected point satisfies beside the equations: a value that is zero there, and its gradient."""


class CurveEquations(Branch):
    """S x + r = f0 + λ f1 in coordinates along the graphs, at one point of the curve and around it.

    Args:
        points: where all points are.
        constant: the load at the factor 0, (n,).
        rate: how it grows with the factor, (n,).
        z: their coordinates, (n,).
        factor: λ.

    Attributes:
        points: where all points are.
        here: the present point.
        unit: of the factor; a power of 2, so that no factor is rounded.
        stood: which points went to and fro at their ends when the last one passed, by rounding alone, (m,): while they
            are slow their rates say nothing.
    """

    def __init__(self, points: ContactPoints, constant: Array, rate: Array, z: Array, factor: float) -> None:
        self._rate, self.points = rate, points
        self.trend, self.unstable = 0, 0
        largest = magnitude(rate / points.forces)
        self.unit = 2.0 ** -round(np.log2(largest)) if largest > np.finfo(float).tiny else 1.0
        y = np.append(z, factor / self.unit)
        values = points.values(z)
        self._held: Array = np.empty((0, len(z)))
        left = (points.stiffness @ values.x + values.force - constant - factor * rate) / points.forces
        self.here = CurvePoint(y=y, tangent=np.zeros_like(y), values=values, left=left)
        self._far = DEFAULT.far * max(magnitude(values.s), 1.0)
        self._factors: Bordered | None = None
        self.stood = np.zeros(len(points), dtype=bool)

    @property
    @override
    def factor(self) -> float:
        return float(self.here.y[-1]) * self.unit

    @property
    @override
    def z(self) -> Array:
        return self.here.y[:-1]

    @property
    @override
    def values(self) -> Values:
        return self.here.values

    @property
    @override
    def stands(self) -> bool:
        return abs(self.rising) <= 1e-6

    @property
    @override
    def directions(self) -> Array:
        return self.rates_at(self.here)

    def rates_at(self, place: CurvePoint) -> Array:
        """How fast the points go along their graphs at a place, (m,).

        Args:
            place: the place.
        """
        return self.points.rates(place.y[:-1], place.tangent[:-1])

    @property
    @override
    def rising(self) -> float:
        rate, tangent = float(self.here.tangent[-1]), self.here.tangent
        return rate if abs(rate) > DEFAULT.reached * magnitude(tangent) else 0.0

    def residual(self, y: Array, values: Values) -> Array:
        """What is left of the forces, in their units, (n,): what is left here, and how the forces change from here.

        The whole displacements of a body that leans far would leave rounding that is larger than a short step.

        Args:
            y: coordinates and factor, (n + 1,).
            values: of the points there.
        """
        here, before = self.here, self.here.values
        change = self.points.stiffness @ (values.x - before.x) + (values.force - before.force)
        change -= (y[-1] - here.y[-1]) * self.unit * self._rate
        return here.left + change / self.points.forces

    def _at_place(self, y: Array, tangent: Array, values: Values) -> CurvePoint:
        return CurvePoint(y=y, tangent=tangent, values=values, left=self.residual(y, values))

    def _factorise(self, values: Values, row: Array) -> Bordered:
        n = len(values.x)
        matrix, self._held = np.empty((n + 1, n + 1), order="F"), self._resting(values)
        matrix[:n, :n] = self.points.jacobian(values, self._held) / self.points.forces[:, None]
        matrix[:n, n] = -self.unit * self._rate / self.points.forces
        matrix[n] = row
        self._factors = None
        self._factors = Bordered(matrix)
        return self._factors

    def _resting(self, values: Values) -> Array:
        """The motions that nothing resists and no load drives: springs hold them, and carry nothing, (d, n)."""
        return self.points.unresisted(values, self._rate).held

    def _changes(self, values: Values) -> Callable[[Array], Array]:
        """How what is left of the forces changes along a direction of all variables, in their units, (n,)."""
        points, moved, risen = self.points, self.points.moved(values), self.points.risen(values)
        stiffness = points.held_stiffness(self._held)

        def change(direction: Array) -> Array:
            found = stiffness @ (moved @ direction[:-1])
            found += risen @ direction[:-1] - direction[-1] * self.unit * self._rate
            return found / points.forces

        return change

    def tangent(self, values: Values, row: Array, sign: float = 1.0) -> Array:
        """The direction of the curve in which a linear function grows, of length 1, (n + 1,).

        Args:
            values: at the point.
            row: the function, (n + 1,).
            sign: -1: in which it falls.

        Raises:
            numpy.linalg.LinAlgError: the function stands along the curve.
        """
        found = self._tangent(values, row, sign)
        for _ in range(DEFAULT.corrections):
            setting_out = self.points.setting_out(values, found[:-1])
            if setting_out is None or np.allclose(setting_out.energies, values.energies, rtol=1e-14, atol=0.0):
                break
            values = setting_out
            found = self._tangent(values, row, sign)
        return found

    def _tangent(self, values: Values, row: Array, sign: float) -> Array:
        found = None if self._factors is None else self._refined(self._factors, values)
        if found is None:
            found = self._factorise(values, row).along
        rate = float(row @ found)
        if rate == 0.0 or not np.all(np.isfinite(found)):
            raise np.linalg.LinAlgError("the equations have no tangent here")
        return found * (sign * np.sign(rate) / np.linalg.norm(found))

    def _refined(self, factors: Bordered, values: Values) -> Array | None:
        """The direction in which the equations stay satisfied, by factors of a point nearby; None: they are too far."""
        found, last, size = factors.along, np.inf, magnitude(factors.along)
        change_along = self._changes(values)
        for _ in range(DEFAULT.corrections):
            step = factors.across(change_along(found))
            change = magnitude(step)
            if not change <= DEFAULT.near * last:
                return found if change <= 1e-13 * size else None
            found, last = found - step, change
            if change <= 1e-15 * size:
                return found
        return None

    def correct(self, y: Array, condition: Condition) -> Array:
        """The point of the curve that satisfies a condition, by Newton's method.

        Args:
            y: near it, (n + 1,).
            condition: the condition.

        Raises:
            Refused: the method does not converge.
            numpy.linalg.LinAlgError: it comes to a point whose equations are singular.
        """
        value, gradient = condition
        size, last = 1.0 + magnitude(y), np.inf
        length = magnitude(y - self.here.y)
        noise = max(1e-10 * (1.0 + length), 1e-14 / self._sharpness(gradient(y)) * size)
        expected = DEFAULT.near * length
        for _ in range(DEFAULT.corrections):
            values = self.points.values(y[:-1])
            left, off = self.residual(y, values), value(y)
            digits = magnitude(left) <= DEFAULT.digits * size
            if not self.points.bent and digits and abs(off) <= DEFAULT.digits * size:
                return y
            step = self._correction(values, left, gradient(y), off, expected)
            change = magnitude(step)
            if not np.isfinite(change) or (change > 2.0 * last and change > 1e-9 * size):
                break
            y = y - step
            allowed = max(noise, DEFAULT.slow * length) if digits else noise
            if change <= 1e-14 * size or (change <= allowed and change >= 0.1 * last):
                return y
            last, expected = change, DEFAULT.near * change
        if last <= noise:
            return y
        raise Refused

    def _correction(self, values: Values, left: Array, row: Array, off: float, expected: float) -> Array:
        """The change that takes out what is left; by factors of a point nearby where it is as small as expected.

        A change that hardly falls is rounding only where the factors are those of the point itself.
        """
        if self._factors is not None and self._factors.takes(row):
            found = self._factors.step(left, row, off)
            if magnitude(found) <= expected:
                return found
        return self._factorise(values, row).step(left, row, off)

    def _sharpness(self, gradient: Array) -> float:
        """How fast a condition's value changes along the curve: what hardly changes fixes a point to few digits."""
        found = abs(float(gradient @ self.here.tangent)) or 1.0
        return min(max(found, 1e-10), 1.0)

    def plane(self, length: float) -> Condition:
        """The plane across the present tangent at a distance."""
        start, tangent = self.here.y, self.here.tangent
        return lambda y: float(tangent @ (y - start)) - length, lambda y: tangent

    def at_end(self, k: int, end: float) -> Condition:
        """A point at an end of its segment.

        Args:
            k: the point.
            end: the s of that end.
        """
        return lambda y: float(self.points.polar(y[:-1])[0][k]) - end, lambda y: self.row(k, y)

    def row(self, k: int, y: Array) -> Array:
        """How the s of a point changes with the variables, (n + 1,).

        Args:
            k: the point.
            y: coordinates and factor, (n + 1,).
        """
        points, found = self.points, np.zeros(len(y))
        p = points.radial(k)
        if p is None:
            found[points.unknowns[k]] = 1.0
        else:
            found[points.vectors.groups[p]] = points.polar(y[:-1])[1][points.vectors.owner == p]
        return found

    def at_factor(self, aim: float) -> Condition:
        """A wanted factor."""
        last = self._factor_row
        return lambda y: float(y[-1]) - aim / self.unit, lambda y: last

    def place(self, y: Array, tangent: Array, passed: int | None = None) -> bool:
        """Go to a point, where points may be on other segments than before; whether the same motions are held.

        Args:
            y: coordinates and factor, (n + 1,).
            tangent: of length 1, (n + 1,).
            passed: the only point that is; None: any point may be.
        """
        self.here = self._at_place(y, tangent, self.points.values(y[:-1]))
        same = are_same(self._resting(self.here.values), self._held)
        if self._factors is not None and (passed is None or not same or not self._exchanged(self._factors, passed)):
            self._factors = None
        return same

    def _exchanged(self, factors: Bordered, k: int) -> bool:
        """Exchange the columns of a point in the factors; whether that went well."""
        columns, change_along = self.points.unknowns[self.points.owner(k)], self._changes(self.here.values)
        units = np.eye(len(self.here.y))[columns]
        return factors.exchange(columns, np.stack([change_along(unit) for unit in units], axis=1))

    @property
    def _factor_row(self) -> Array:
        """The factor as a linear function of the variables, (n + 1,)."""
        return np.eye(1, len(self.here.y), len(self.here.y) - 1)[0]

    def head(self, row: Array, sign: float = 1.0) -> None:
        """Set out from the present point in the direction in which a linear function grows.

        Args:
            row: the function, (n + 1,).
            sign: -1: in which it falls.

        Raises:
            numpy.linalg.LinAlgError: the function stands along the curve.
        """
        self.here = replace(self.here, tangent=self.tangent(self.here.values, row, sign))

    def head_with_load(self, sign: float) -> None:
        """Set out from the present point where the load takes the body as the factor grows.

        Args:
            sign: -1: as it falls.

        Raises:
            numpy.linalg.LinAlgError: the factor stands along the curve, and no rigid motion is free.
        """
        values = self.here.values
        driven = self.points.unresisted(values, self._rate).driven
        along = np.append(self.points.moved(values).sparse.T @ driven, 0.0)
        self.head(along if np.any(driven) else self._factor_row, sign)


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
        self._row = matrix[-1].copy()
        self._inverse = by_factors(matrix, DEFAULT.waits)
        if not self._has_tangent():
            raise np.linalg.LinAlgError("the equations have no tangent here")

    def _has_tangent(self) -> bool:
        """Find the direction in which the equations stay satisfied; whether there is one."""
        self.along = self._inverse.solve(np.eye(1, len(self._row), len(self._row) - 1)[0])
        self._length = float(np.linalg.norm(self.along))
        return 0.5 < float(self._row @ self.along) < 2.0  # it is 1 where any digit is left

    def exchange(self, columns: Integers, values: Array) -> bool:
        """Put other columns into the equations; whether that went well. If not, the factors are good for nothing.

        Args:
            columns: their numbers, (k,).
            values: the new ones, (n, k).
        """
        for place, value in zip(columns, values.T, strict=True):
            spread = self._inverse.solve(np.append(value, self._row[place]))
            if self._inverse.is_long or not abs(spread[place]) > DEFAULT.small * magnitude(spread):
                return False
            self._inverse.exchange(spread, int(place))
        return self._has_tangent() and self.takes(self._row)

    def across(self, left: Array) -> Array:
        """The change of the variables that takes out what is left of the equations and keeps the row, (n + 1,).

        Args:
            left: what is left, (n,).
        """
        return self._inverse.solve(np.append(left, 0.0))

    def takes(self, row: Array) -> bool:
        """Whether another row can stand beside the equations.

        Args:
            row: the row, (n + 1,).
        """
        return abs(float(row @ self.along)) > DEFAULT.small * float(np.linalg.norm(row)) * self._length

    def step(self, left: Array, row: Array, value: float) -> Array:
        """The change that takes out what is left of the equations and of another row, (n + 1,).

        Args:
            left: of the equations, (n,).
            row: the row, (n + 1,).
            value: what is left of it.
        """
        found = self.across(left)
        return found + self.along * ((value - float(row @ found)) / float(row @ self.along))
