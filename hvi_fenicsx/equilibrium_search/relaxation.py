"""The convex programme that bounds the energy on a box from below: envelopes of the laws, curvature given to them.

With a diagonal D such that S - D is positive semidefinite, ½ xᵀSx + Σ φᵢ = ½ xᵀ(S - D)x + Σ (½ dᵢ xᵢ² + φᵢ), and the
envelope of a sum is above the sum of the envelopes. A law whose steepest fall is less than its dᵢ becomes convex; of
a drop c remains a gap of at most c²/(8 dᵢ), however wide the interval. Unknowns whose law only rises on their
interval need no dᵢ, and their own least slope adds to S.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Integers, Mask
from .arcs import ArcTable
from .convex_programme import Optimum, envelopes, minimise, never
from .length_programme import LengthProgramme
from .rigid_balance import kernel
from .scalar_problem import Box, ScalarProblem
from .thresholds import LIMITS


@dataclass(frozen=True, kw_only=True)
class Curvature:
    """The diagonal D of one box.

    Attributes:
        added: d, which is negative where the law's own slope is given to S, (n + m,).
        radii: half widths (n + m,) of what strong convexity allows for a gap of ½; inf where a rigid motion moves.
        range_radii: the same of displacements without rigid motions.
    """

    added: Array
    radii: Array
    range_radii: Array


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
        self._stiff = float(np.trace(problem.stiffness)) / problem.size or 1.0

    def diagonal(self, low: Array, high: Array) -> Array:
        """The diagonal D of a box, (n + m,).

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
        """
        return self._curvature(low, high, np.zeros(len(low))).added

    def solve(self, box: Box) -> Minimum:
        """The minimum on a box.

        Args:
            box: the box, finite.
        """
        curvature = self._curvature(box.low, box.high, box.weights)
        stack = envelopes(self.problem, box.low, box.high, curvature.added)
        return self._examined(box, self._minimised(box, curvature, stack), stack, curvature)

    def _minimised(self, box: Box, curvature: Curvature, stack: ArcTable) -> Optimum:
        problem = self.problem
        a, b = problem.stiffness - np.diag(problem.diagonal(curvature.added)), problem.force
        if len(problem.lengths):
            shut = curvature.added[problem.size :]
            programme = LengthProgramme(
                problem=problem, a=a, b=b, laws=stack, shut=shut, low=box.low, high=box.high, cut=self._cut
            )
            found = programme.bound(programme.minimiser(box.x))
        else:
            found = minimise(a, b, stack, box.x, self._cut)
        return Optimum(x=found.x, bound=found.bound + problem.constant)

    def _examined(self, box: Box, found: Optimum, stack: ArcTable, curvature: Curvature) -> Minimum:
        """Where envelopes are not tight."""
        problem, x, at = self.problem, found.x, self.problem.arguments(found.x)
        tight = LIMITS.rounding * problem.energy_size(x)
        gaps = problem.arcs.energy(at) + 0.5 * curvature.added * at * at - stack.energy(at)
        gaps = np.where((gaps > tight) & (box.high > box.low), gaps, 0.0)
        i = int(np.argmax(gaps))
        begin, end = stack.around(at)
        spread = np.where(gaps > 0.0, 0.5 * (at - begin) * (end - at), 0.0)
        place, gap = self._place(i, float(begin[i]), float(end[i]), float(at[i])), float(gaps[i])
        return Minimum(x=x, bound=found.bound, curvature=curvature, spread=spread, gap=gap, argument=i, place=place)

    def _place(self, i: int, begin: float, end: float, at: float) -> float:
        """The joint of a law in the chord of its envelope that is nearest to a place; the place if there is none."""
        joints = self.problem.arcs.high[i]
        inside = joints[(joints > begin) & (joints < end)]
        return float(inside[np.argmin(np.abs(inside - at))]) if inside.size else at

    @cached_property
    def kernel(self) -> Array:
        """Orthonormal columns that S maps to zero, (n, k)."""
        return kernel(self.problem.stiffness)

    def _curvature(self, low: Array, high: Array, seen: Array) -> Curvature:
        """D on a box; ``seen``: where envelopes were not tight, (n + m,), all zero where nothing is known."""
        problem = self.problem
        slope, drops = problem.arcs.least_slope(low, high), problem.arcs.drops(low, high)
        undecided = np.flatnonzero((high > low) & ((drops > 0.0) | (slope < 0.0)))
        own = np.where(np.isfinite(slope), np.maximum(slope, 0.0), 0.0)
        own[problem.size :] = self._own_of_lengths(low, own, drops)
        most = float(seen[undecided].max(initial=0.0))
        strength = np.where(drops > 0.0, drops, -slope * (high - low)) * (
            seen / most + LIMITS.worthwhile if most > 0.0 else 1.0
        )
        need = np.where(drops > 0.0, np.inf, np.maximum(-slope, 0.0))
        matrix = problem.stiffness + np.diag(problem.diagonal(own))
        free = self._free_motions(matrix)
        added = self._given(matrix, free, undecided, strength[undecided], need)
        radii = self._radii(self._inverse(matrix - np.diag(problem.diagonal(added)), free))
        return Curvature(added=added - own, radii=np.where(self._moved(free), np.inf, radii), range_radii=radii)

    def _own_of_lengths(self, low: Array, own: Array, drops: Array) -> Array:
        """Slopes that laws of lengths give to S and still do not fall, (m,)."""
        n = self.problem.size
        rate = np.maximum(self.problem.arcs.rates(np.nextafter(low, np.inf))[n:], 0.0)  # behind a drop at the end
        secant = np.divide(rate, low[n:], out=np.full_like(rate, np.inf), where=low[n:] > 0.0)
        return np.where(self.problem.lengths.opens | (drops[n:] > 0.0), 0.0, np.minimum(own[n:], secant))

    def _given(self, matrix: Array, free: Array, undecided: Integers, weights: Array, need: Array) -> Array:
        """D, (n + m,): in proportion to the weights, but no more than is needed."""
        added = np.zeros(len(need))
        fixed = self._moved(free)[undecided]
        left, weights = undecided[~fixed], np.maximum(weights[~fixed], 1e-12)
        while left.size:
            inverse = self._inverse(matrix - np.diag(self.problem.diagonal(added)), free)
            given = LIMITS.part / self._largest(inverse, left, weights) * weights
            enough = given >= need[left]
            if not enough.any():
                added[left] = given
                break
            added[left[enough]] = need[left[enough]]
            left, weights = left[~enough], weights[~enough]
        return added

    def _inverse(self, matrix: Array, motions: Array) -> Array:
        """The inverse of a matrix that is made regular along rigid motions."""
        return np.linalg.inv(matrix + self._stiff * motions @ motions.T)

    def _moved(self, motions: Array) -> Mask:
        """Which arguments a rigid motion moves, (n + m,)."""
        lengths = self.problem.lengths
        unknowns = np.any(np.abs(motions) > LIMITS.accuracy, axis=1)
        return np.concatenate([unknowns, np.any(unknowns[lengths.unknowns] & lengths.there, axis=1)])

    def _largest(self, inverse: Array, left: Integers, weights: Array) -> float:
        """The largest share θ has θ times this eigenvalue = 1: of S⁻¹ on the weighted components of some arguments."""
        lengths, n = self.problem.lengths, self.problem.size
        vectors, q = left[left >= n] - n, np.sqrt(weights)
        there = lengths.there[vectors]
        rows = np.concatenate([left[left < n], lengths.unknowns[vectors][there]])
        sizes = (q[left >= n, None] * np.abs(lengths.factors[vectors]))[there]
        scale = np.concatenate([q[left < n], sizes])
        return float(np.linalg.eigvalsh(scale[:, None] * inverse[np.ix_(rows, rows)] * scale)[-1])

    def _radii(self, inverse: Array) -> Array:
        lengths = self.problem.lengths
        blocks = inverse[lengths.unknowns[:, :, None], lengths.unknowns[:, None, :]]
        blocks = lengths.factors[:, :, None] * blocks * lengths.factors[:, None, :]
        squares = np.concatenate([np.diag(inverse), np.linalg.eigvalsh(blocks)[:, -1]])
        return np.sqrt(np.maximum(squares, 0.0))

    def _free_motions(self, along: Array) -> Array:
        """The rigid motions that a matrix does not resist, orthonormal columns."""
        rigid = self.kernel
        if not rigid.shape[1]:
            return rigid
        values, vectors = np.linalg.eigh(rigid.T @ along @ rigid)
        return rigid @ vectors[:, values <= LIMITS.zero * self._stiff]
