"""Stationary points of curved laws: Newton's method on the laws themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array, Mask
from . import stationarity
from .scalar_problem import ScalarProblem
from .stationarity import StationaryPoint, Subdifferential


@dataclass(frozen=True, kw_only=True)
class CurvedLaws:
    """Laws of one component each, some of them curved.

    Attributes:
        near: the problem with polylines near the laws.
        problem: the problem with the laws, at the load factor 1.
    """

    near: ScalarProblem
    problem: CondensedProblem

    def point(self, x: Array) -> StationaryPoint | None:
        """The stationary point near one of the polylines; None where there is none.

        An unknown stays where a jump of its laws or a bound bears the force.

        Args:
            x: displacements, (n,).
        """
        near, start, best, limits = self.near, x, None, self.near.thresholds.points
        size = float(np.max(np.abs(near.force), initial=0.0)) or 1.0
        for _ in range(near.thresholds.programmes.most_steps):
            force, allowed = near.force - near.stiffness @ x, self.subdifferential(x)
            rest = force - np.clip(force, allowed.low, allowed.high)
            missing = float(np.max(np.abs(rest), initial=0.0))
            if best is not None and missing >= limits.faster * best[0] and best[0] <= limits.accuracy * size:
                break
            best = missing, x, allowed
            jumps = allowed.high - allowed.low > limits.accuracy * size
            x = np.clip(x + self._step(rest, allowed, ~jumps | (rest != 0.0)), near.lower, near.upper)
            if not np.max(np.abs(x - start)) <= limits.longest * (1.0 + np.max(np.abs(start))):
                break
        if best is None or not best[0] <= min(limits.accuracy * size, self.rounding(*best[1:])):
            return None
        return self._found(*best[1:])

    def rounding(self, x: Array, allowed: Subdifferential) -> float:
        """The largest force that may be missing in a balance because of rounding.

        Args:
            x: displacements, (n,).
            allowed: what the laws and bounds allow there.
        """
        near = self.near
        stiffness = np.abs(near.stiffness) + np.diag(np.abs(allowed.least))
        sizes = self.tractions(x)[1] + np.abs(near.force) + stiffness @ np.abs(x)
        return float(near.thresholds.points.roundings * len(x) * np.finfo(float).eps * np.max(sizes, initial=0.0))

    def tractions(self, x: Array) -> tuple[Array, Array]:
        """The forces of the laws where none jumps, and the sum of the sizes of their parts, (n,) each.

        Args:
            x: displacements, (n,).
        """
        total, sizes = np.zeros((2, self.near.size))
        for bonds in self.problem.bonds:
            at, argument = bonds.unknowns[:, 0], bonds.argument(x)
            factors = bonds.weights * bonds.signs[:, 0]
            rises, falls = bonds.law.convex.right(argument), bonds.law.concave.right(argument)
            np.add.at(total, at, factors * bonds.law.right(argument))
            np.add.at(sizes, at, np.abs(factors) * (np.abs(rises) + np.abs(falls)))
        return total, sizes

    def _found(self, x: Array, allowed: Subdifferential) -> StationaryPoint:
        kind = stationarity.kind_at(self.near, x, allowed)
        return StationaryPoint(x=x, energy=self.problem.energy(x), kind=kind, isolated=True)

    def _step(self, rest: Array, allowed: Subdifferential, free: Mask) -> Array:
        """Newton's step of the free unknowns; the shortest where the matrix is singular."""
        step = np.zeros(len(rest))
        matrix = self.near.stiffness[np.ix_(free, free)] + np.diag(allowed.least[free])
        try:
            step[free] = np.linalg.solve(matrix, rest[free])
        except np.linalg.LinAlgError:
            step[free] = np.linalg.lstsq(matrix, rest[free], rcond=None)[0]
        return step

    def subdifferential(self, x: Array) -> Subdifferential:
        """What the laws and bounds allow at a point.

        Args:
            x: displacements, (n,).
        """
        close = self.near.thresholds.points.accuracy * (1.0 + float(np.max(np.abs(x), initial=0.0)))
        low, high, slope = np.zeros((3, self.near.size))
        falls = np.zeros(self.near.size, dtype=np.bool_)
        for bonds in self.problem.bonds:
            at, argument = bonds.unknowns[:, 0], bonds.argument(x)
            for total, force in zip((low, high), _forces(bonds, argument, close), strict=True):
                np.add.at(total, at, force)
            second = bonds.law.convex.second(argument) - bonds.law.concave.second(argument)
            np.add.at(slope, at, bonds.weights * bonds.signs[:, 0] ** 2 * second)
            for kink in bonds.law.concave.kinks:
                falls[at[(np.abs(argument - kink) <= close) & (bonds.weights > 0.0)]] = True
        laws = Subdifferential(low=low, high=high, falls=falls, least=slope, most=slope)
        return stationarity.with_bounds(self.near, x, laws)


def _forces(bonds: Bonds, argument: Array, close: float) -> tuple[Array, Array]:
    """The least and the largest force of each bond."""
    factors = bonds.weights * bonds.signs[:, 0]
    ends = [factors * traction for traction in bonds.law.interval(argument, close)]
    return np.minimum(*ends), np.maximum(*ends)
