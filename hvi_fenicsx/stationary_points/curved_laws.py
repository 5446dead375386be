"""Stationary points of curved laws: Newton's method on the laws themselves; and bounds of their slopes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..reduced.condensed_problem import Bonds, CondensedProblem
from ..typing import Array, Mask
from . import stationarity
from .point_list import StationaryPoint
from .scalar_problem import ScalarProblem
from .stationarity import Subdifferential


@dataclass(frozen=True, kw_only=True)
class CurvedLaws:
    """Laws of one component each, some of them curved.

    Attributes:
        near: the problem with polylines near the laws' tractions.
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
        for _ in range(limits.newton_steps):
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

    def is_balanced(self, x: Array) -> bool:
        """Whether no more force is missing at a place than rounding makes.

        Args:
            x: displacements, (n,).
        """
        force, allowed = self.near.force - self.near.stiffness @ x, self.subdifferential(x)
        missing = np.abs(force - np.clip(force, allowed.low, allowed.high))
        return bool(np.max(missing, initial=0.0) <= self.rounding(x, allowed))

    def soft_direction(self, x: Array) -> Array | None:
        """The direction in which S plus the laws' slopes is next to zero, largest part 1, (n,); None if there is none.

        Args:
            x: displacements, (n,).
        """
        allowed, near, limits = self.subdifferential(x), self.near, self.near.thresholds.points
        size = float(np.max(np.abs(near.force), initial=0.0)) or 1.0
        free = np.flatnonzero(allowed.high - allowed.low <= limits.accuracy * size)
        if not free.size:
            return None
        values, vectors = np.linalg.eigh(near.stiffness[np.ix_(free, free)] + np.diag(allowed.least[free]))
        k = int(np.argmin(np.abs(values)))
        if abs(values[k]) > limits.soft * float(np.max(np.diag(near.stiffness))):
            return None
        way = np.zeros(near.size)
        way[free] = vectors[:, k] / np.max(np.abs(vectors[:, k]))
        return way

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

    @property
    def bounded(self) -> bool:
        """Whether bounds of all slopes are known, and of what the polylines differ by."""
        ranges = [b.law.slope_range(*np.full((2, 1), b.law.length_scale)) for b in self.problem.bonds]
        return self.near_enough and bool(np.all(np.isfinite(ranges)))

    @property
    def near_enough(self) -> bool:
        """Whether it is known by how much the polylines' forces differ from those of the laws."""
        return bool(np.all(np.isfinite(self.near.force_error)))

    def slopes(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of the slopes of all chords of the laws' graphs and of what bounds bear, on intervals, (n,) each.

        They are infinite where a traction jumps inside. At the end of an interval a jump is not counted, a bound is.

        Args:
            low: of the intervals, (n,).
            high: of the intervals, (n,).
        """
        least, most = np.zeros((2, self.near.size))
        one_place = self.near.thresholds.points.one_place
        for bonds in self.problem.bonds:
            there = bonds.weights > 0.0
            at, signs, weights = bonds.unknowns[there, 0], bonds.signs[there, 0], bonds.weights[there]
            ends = np.sort(np.stack([signs * low[at], signs * high[at]]), axis=0)
            first, last = bonds.law.slope_range(*ends)
            first = np.where(_inside(bonds.law.concave.kinks, ends, one_place), -np.inf, first)
            last = np.where(_inside(bonds.law.convex.kinks, ends, one_place), np.inf, last)
            np.add.at(least, at, weights * signs**2 * first)
            np.add.at(most, at, weights * signs**2 * last)
        bears = (low <= self.near.lower) | (high >= self.near.upper)
        return least, np.where(bears, np.inf, most)

    def forces(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of the laws' forces on intervals, jumps at the ends included, (n,) each.

        The traction is H' - G', and neither of the two falls.

        Args:
            low: of the intervals, (n,).
            high: of the intervals, (n,).
        """
        least, most = np.zeros((2, self.near.size))
        for bonds in self.problem.bonds:
            at, signs, law = bonds.unknowns[:, 0], bonds.signs[:, 0], bonds.law
            begin, end = np.sort(np.stack([signs * low[at], signs * high[at]]), axis=0)
            ends = (
                bonds.weights * signs * (law.convex.left(begin) - law.concave.right(end)),
                bonds.weights * signs * (law.convex.right(end) - law.concave.left(begin)),
            )
            np.add.at(least, at, np.minimum(*ends))
            np.add.at(most, at, np.maximum(*ends))
        return least, most

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

    def sides(self, x: Array) -> tuple[Array, Array]:
        """The forces of the laws just before and just behind displacements, (n,) each.

        Args:
            x: displacements, (n,).
        """
        before, after = np.zeros((2, self.near.size))
        for bonds in self.problem.bonds:
            argument, factors = bonds.argument(x), bonds.weights * bonds.signs[:, 0]
            ends = [factors * side(argument) for side in (bonds.law.left, bonds.law.right)]
            there = factors > 0.0
            np.add.at(before, bonds.unknowns[:, 0], np.where(there, *ends))
            np.add.at(after, bonds.unknowns[:, 0], np.where(there, *ends[::-1]))
        return before, after

    def most_slopes(self, low: Array, high: Array) -> Array:
        """Upper bounds of the slopes of the laws' graphs off the kinks, (k, n).

        Args:
            low: of k intervals for each unknown, (k, n).
            high: of them, (k, n).
        """
        most = np.zeros(low.shape)
        for bonds in self.problem.bonds:
            at, signs = bonds.unknowns[:, 0], bonds.signs[:, 0]
            ends = np.sort([signs * low[:, at], signs * high[:, at]], axis=0)
            last = bonds.law.slope_range(*ends.reshape(2, -1))[1].reshape(len(low), -1)
            np.add.at(most.T, at, (bonds.weights * signs**2 * last).T)
        return most

    @cached_property
    def convex_kinks(self) -> Array:
        """Displacements at which a law of an unknown jumps upwards; infinite where it has fewer than others, (k, n)."""
        found: list[list[float]] = [[] for _ in range(self.near.size)]
        for bonds in self.problem.bonds:
            for i, sign in zip(bonds.unknowns[:, 0], bonds.signs[:, 0], strict=True):
                found[i] += [float(kink / sign) for kink in bonds.law.convex.kinks]
        most = max(map(len, found))
        return np.array([[*kinks, *[np.inf] * (most - len(kinks))] for kinks in found]).T

    def upward_jumps(self, x: Array) -> Array:
        """How far the forces of the laws jump upwards at places, (k, n); zero off the kinks.

        Args:
            x: k places for each unknown, (k, n).
        """
        total = np.zeros(x.shape)
        for bonds in self.problem.bonds:
            at, signs, part = bonds.unknowns[:, 0], bonds.signs[:, 0], bonds.law.convex
            for kink, jump in zip(part.kinks, part.jumps, strict=True):
                there = x[:, at] == kink / signs
                np.add.at(total.T, at, np.where(there, bonds.weights * np.abs(signs) * jump, 0.0).T)
        return total

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
            step[free] = np.linalg.lstsq(matrix, rest[free], rcond=self.near.thresholds.points.singular)[0]
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


def _inside(kinks: Array, ends: Array, one_place: float) -> Mask:
    """Whether a kink is inside intervals, (m,); one that only rounding tells apart from an end is not."""
    apart = one_place * np.abs(kinks)
    return np.asarray(((kinks - apart > ends[0][:, None]) & (kinks + apart < ends[1][:, None])).any(axis=1))
