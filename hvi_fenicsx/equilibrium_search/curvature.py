"""How much curvature of the elastic energy each unknown can be given, so that its law's envelope is tighter.

With a diagonal D such that S - D is positive semidefinite, ½ xᵀSx + Σ φᵢ = ½ xᵀ(S - D)x + Σ (½ dᵢ xᵢ² + φᵢ), and the
envelope of a sum is above the sum of the envelopes. A law whose steepest fall is less than its dᵢ becomes convex; of
a drop c remains a gap of at most c²/(8 dᵢ), however wide the interval. Unknowns whose law only rises on their
interval need no dᵢ, and their own least slope adds to S.

A rigid motion costs no elastic energy, so no D > 0 of laws that it moves leaves S - D positive semidefinite. There
½ σ s² can be lent, s = c·x being the motion's share, whose chord over the interval of s in a box is taken off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Integers, Mask
from .arcs import FREE
from .scalar_problem import ScalarProblem
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


class CurvatureShare:
    """Shares of the curvature of S.

    Args:
        problem: the problem.

    Attributes:
        lent: σ, as stiff as S.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem = problem
        self.lent = float(np.trace(problem.stiffness)) / problem.size or 1.0

    @cached_property
    def kernel(self) -> Array:
        """Orthonormal columns that S maps to zero, (n, k)."""
        values, vectors = np.linalg.eigh(self._problem.stiffness)
        zero = LIMITS.zero * max(float(values[-1]), 0.0)
        return np.asarray(vectors[:, values <= zero])

    @cached_property
    def shapes(self) -> Array:
        """Orthonormal columns: how rigid motions move the unknowns with laws, (n, k)."""
        problem = self._problem
        with_law = np.array([c != FREE for c in problem.chains[: problem.size]], dtype=np.bool_)
        with_law[problem.lengths.members] = True
        columns, sizes, _ = np.linalg.svd(np.where(with_law[:, None], self.kernel, 0.0), full_matrices=False)
        return np.asarray(columns[:, sizes > LIMITS.accuracy])

    def share(self, low: Array, high: Array, undecided: Integers, seen: Array, *, lend: bool = False) -> Curvature:
        """D on a box.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
            undecided: arguments whose law is not convex on the box.
            seen: where envelopes were not tight, (n + m,); all zero where nothing is known.
            lend: whether curvature is lent along rigid motions.
        """
        problem = self._problem
        slope, drops = problem.arcs.least_slope(low, high), problem.arcs.drops(low, high)
        own = np.where(np.isfinite(slope), np.maximum(slope, 0.0), 0.0)
        own[problem.size :] = 0.0
        most = float(seen[undecided].max(initial=0.0))
        strength = np.where(drops > 0.0, drops, -slope * (high - low)) * (
            seen / most + LIMITS.worthwhile if most > 0.0 else 1.0
        )
        need = np.where(drops > 0.0, np.inf, np.maximum(-slope, 0.0))
        matrix = problem.stiffness + np.diag(problem.diagonal(own))
        if lend:
            matrix += self.lent * self.shapes @ self.shapes.T
        free = self._free_motions(matrix)
        added = self._given(matrix, free, undecided, strength[undecided], need)
        radii = self._radii(self._inverse(matrix - np.diag(problem.diagonal(added)), free))
        return Curvature(added=added - own, radii=np.where(self._moved(free), np.inf, radii), range_radii=radii)

    def _given(self, matrix: Array, free: Array, undecided: Integers, weights: Array, need: Array) -> Array:
        """D, (n + m,): in proportion to the weights, but no more than is needed."""
        added = np.zeros(len(need))
        fixed = self._moved(free)[undecided]
        left, weights = undecided[~fixed], np.maximum(weights[~fixed], 1e-12)
        while left.size:
            inverse = self._inverse(matrix - np.diag(self._problem.diagonal(added)), free)
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
        return np.asarray(np.linalg.inv(matrix + self.lent * motions @ motions.T), dtype=np.float64)

    def _moved(self, motions: Array) -> Mask:
        """Which arguments a rigid motion moves, (n + m,)."""
        lengths = self._problem.lengths
        unknowns = np.any(np.abs(motions) > LIMITS.accuracy, axis=1)
        return np.concatenate([unknowns, np.any(unknowns[lengths.unknowns] & lengths.there, axis=1)])

    def _largest(self, inverse: Array, left: Integers, weights: Array) -> float:
        """The largest share θ has θ times this eigenvalue = 1: of S⁻¹ on the weighted components of some arguments."""
        lengths, n = self._problem.lengths, self._problem.size
        vectors, q = left[left >= n] - n, np.sqrt(weights)
        there = lengths.there[vectors]
        rows = np.concatenate([left[left < n], lengths.unknowns[vectors][there]])
        sizes = (q[left >= n, None] * np.abs(lengths.factors[vectors]))[there]
        scale = np.concatenate([q[left < n], sizes])
        return float(np.linalg.eigvalsh(scale[:, None] * inverse[np.ix_(rows, rows)] * scale)[-1])

    def _radii(self, inverse: Array) -> Array:
        lengths = self._problem.lengths
        blocks = inverse[lengths.unknowns[:, :, None], lengths.unknowns[:, None, :]]
        blocks = lengths.factors[:, :, None] * blocks * lengths.factors[:, None, :]
        squares = np.concatenate([np.diag(inverse), np.linalg.eigvalsh(blocks)[:, -1]])
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    def _free_motions(self, along: Array) -> Array:
        """The rigid motions that a matrix does not resist, orthonormal columns."""
        rigid = self.kernel
        if not rigid.shape[1]:
            return rigid
        values, vectors = np.linalg.eigh(rigid.T @ along @ rigid)
        return np.asarray(rigid @ vectors[:, values <= LIMITS.zero * self.lent])
