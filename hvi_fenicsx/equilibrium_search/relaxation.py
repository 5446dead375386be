"""The convex programme that bounds the energy on a box from below: envelopes of the laws, curvature given to them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Integers
from .arcs import ArcTable
from .convex_programme import Optimum, minimise, never
from .curvature import Curvature, CurvatureShare
from .envelopes import envelopes
from .length_programme import LengthProgramme
from .scalar_problem import Box, ScalarProblem
from .thresholds import LIMITS


@dataclass(frozen=True, kw_only=True)
class Minimum:
    """The minimum of a relaxation on a box.

    Attributes:
        x: the minimiser, (n,).
        bound: no point of the box has a lower energy; by strong convexity it grows with the distance from x.
        curvature: that the laws were given.
        spread: where envelopes are not tight, (n + m,).
        gap: the largest by which an envelope is below its law at x; 0 where the relaxation is the energy.
        argument: of that law.
        place: where its interval is to be divided.
    """

    x: Array
    bound: float
    curvature: Curvature
    spread: Array
    gap: float
    argument: int
    place: float


class Relaxation:
    """Relaxations of one problem.

    Args:
        problem: the problem.
        cut: whether convex programmes are to be cut short, since the search stops; the bounds hold for any point.
    """

    def __init__(self, problem: ScalarProblem, cut: Callable[[], bool] = never) -> None:
        self.problem, self._cut = problem, cut
        self._share = CurvatureShare(problem)

    def undecided(self, low: Array, high: Array) -> Integers:
        """Arguments whose law is not convex on a box.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
        """
        arcs = self.problem.arcs
        wide = high > low
        return np.flatnonzero(wide & ((arcs.drops(low, high) > 0.0) | (arcs.least_slope(low, high) < 0.0)))

    @property
    def kernel(self) -> Array:
        """Orthonormal columns of rigid motions, (n, k)."""
        return self._share.kernel

    def diagonal(self, low: Array, high: Array) -> Array:
        """The diagonal D of a box, (n + m,).

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
        """
        return self._share.share(low, high, self.undecided(low, high), np.zeros(len(low))).added

    def solve(self, box: Box, lost: float = 0.0) -> Minimum:
        """The minimum on a box.

        Args:
            box: the box, finite.
            lost: energy that the chords of rigid motions may take off.
        """
        low, high, undecided = box.low, box.high, self.undecided(box.low, box.high)
        lent = self._lent(low, high) if undecided.size else None
        if lent is not None and lent.cost > lost:
            lent = None
        curvature = self._share.share(low, high, undecided, box.weights, lend=lent is not None)
        stack = envelopes(self.problem, low, high, curvature.added)
        found = self._minimised(box, curvature, lent, stack)
        return self._examined(box, found, stack, curvature, lent)

    def _lent(self, low: Array, high: Array) -> _Lent | None:
        """The curvature along rigid motions, with the intervals of their shares in a box."""
        shapes, n = self._share.shapes, self.problem.size
        if not shapes.size:
            return None
        ends = np.sort(np.stack([shapes * low[:n, None], shapes * high[:n, None]]), axis=0)
        slack = LIMITS.rounding * np.abs(ends).sum(axis=(0, 1))
        first, last = ends.sum(axis=1)
        return _Lent(shapes=shapes, stiffness=self._share.lent, low=first - slack, high=last + slack)

    def _minimised(self, box: Box, curvature: Curvature, lent: _Lent | None, stack: ArcTable) -> Optimum:
        problem = self.problem
        a, b, constant = problem.stiffness - np.diag(problem.diagonal(curvature.added)), problem.force, problem.constant
        if lent is not None:
            a, b, constant = a + lent.matrix, b + lent.force, constant + lent.constant
        if len(problem.lengths):
            shut = curvature.added[problem.size :]
            programme = LengthProgramme(
                problem=problem, a=a, b=b, laws=stack, shut=shut, low=box.low, high=box.high, cut=self._cut
            )
            found = programme.bound(programme.minimiser(box.x))
        else:
            found = minimise(a, b, stack, box.x, self._cut)
        return Optimum(x=found.x, bound=found.bound + constant)

    def _examined(self, box: Box, found: Optimum, stack: ArcTable, curvature: Curvature, lent: _Lent | None) -> Minimum:
        """Where envelopes are not tight, and chords take something off."""
        problem, x, at = self.problem, found.x, self.problem.arguments(found.x)
        tight = LIMITS.rounding * problem.energy_size(x)
        gaps = problem.arcs.energy(at) + 0.5 * curvature.added * at * at - stack.energy(at)
        gaps = np.where((gaps > tight) & (box.high > box.low), gaps, 0.0)
        i = int(np.argmax(gaps))
        begin, end = stack.around(at)
        spread = np.where(gaps > 0.0, 0.5 * (at - begin) * (end - at), 0.0)
        place, gap = self._place(i, float(begin[i]), float(end[i]), float(at[i])), float(gaps[i])
        if lent is not None and (off := lent.gap(x)) > max(gap, tight):
            i, gap = int(np.argmax(np.abs(lent.shapes).max(axis=1) * (box.high - box.low)[: problem.size])), off
            place = 0.5 * float(box.low[i] + box.high[i])
        return Minimum(x=x, bound=found.bound, curvature=curvature, spread=spread, gap=gap, argument=i, place=place)

    def _place(self, i: int, begin: float, end: float, at: float) -> float:
        """The joint of a law in the chord of its envelope that is nearest to a place; the place if there is none."""
        joints = self.problem.arcs.high[i]
        inside = joints[(joints > begin) & (joints < end)]
        return float(inside[np.argmin(np.abs(inside - at))]) if inside.size else at


@dataclass(frozen=True, kw_only=True)
class _Lent:
    """Curvature σ along the shapes of rigid motions, (n, k), less its chords over the intervals of their shares."""

    shapes: Array
    stiffness: float
    low: Array
    high: Array

    @cached_property
    def cost(self) -> float:
        """What the chords take off at most."""
        return float(self.stiffness * ((self.high - self.low) ** 2).sum() / 8.0)

    @property
    def matrix(self) -> Array:
        """What is added to S, (n, n)."""
        return np.asarray(self.stiffness * self.shapes @ self.shapes.T)

    @property
    def force(self) -> Array:
        """What the chords add to f, (n,)."""
        return np.asarray(self.shapes @ (self.stiffness * 0.5 * (self.low + self.high)))

    @property
    def constant(self) -> float:
        """What the chords add to the energy, less its rounding."""
        parts = 0.5 * self.stiffness * self.low * self.high
        return float(parts.sum() - np.finfo(float).eps * len(self.shapes) * np.abs(parts).sum())

    def gap(self, x: Array) -> float:
        """What the chords take off at a point, (n,)."""
        s = self.shapes.T @ x
        return float(0.5 * self.stiffness * np.maximum((s - self.low) * (self.high - s), 0.0).sum())
