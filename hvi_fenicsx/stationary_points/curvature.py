"""How much curvature of the elastic energy each unknown can be given, so that its law's envelope is tighter.

With a diagonal D such that S - D is positive semidefinite, ½ xᵀSx + Σ φᵢ = ½ xᵀ(S - D)x + Σ (½ dᵢ xᵢ² + φᵢ), and the
envelope of a sum is above the sum of the envelopes. A law whose steepest fall is less than its dᵢ becomes convex; of
a drop c remains a gap of at most c²/(8 dᵢ), however wide the interval. Unknowns whose law only rises on their
interval need no dᵢ, and their own least slope adds to S.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from ..typing import Array, Integers, Mask
from .scalar_problem import ScalarProblem

REGULAR = 1e-10
"""Eigenvalues of S below this share of the largest one are zero."""
MOST_ROUNDS = 4
"""How often what some unknowns do not need is given to the others."""


def kernel(stiffness: Array) -> Array:
    """Orthonormal columns that S maps to zero, (n, k).

    Args:
        stiffness: S.
    """
    values, vectors = eigh(stiffness)
    return np.asarray(vectors[:, values <= REGULAR * max(float(values[-1]), 0.0)])


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
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem = problem
        self._scale = float(np.trace(problem.stiffness)) / problem.size or 1.0

    @cached_property
    def _kernel(self) -> Array:
        return kernel(self._problem.stiffness)

    def share(self, low: Array, high: Array, undecided: Integers, weights: Array, part: float) -> Curvature:
        """D on a box.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
            undecided: arguments whose law is not convex on the box.
            weights: how much of D each of these is to have, (n + m,).
            part: the share of the largest D of that kind that is taken, below 1.
        """
        problem = self._problem
        slope = problem.arcs.least_slope(low, high)
        drops = problem.arcs.drops(low, high) > 0.0
        own = self._own(low, slope, drops)
        matrix = problem.stiffness + np.diag(problem.diagonal(own))
        motions = self._free_motions(problem.diagonal(own))
        need = np.where(drops, np.inf, np.maximum(-slope, 0.0))
        added = np.zeros(len(low))
        left = undecided[~self._moved(motions)[undecided]]
        for _ in range(MOST_ROUNDS):
            if not left.size:
                break
            inverse = self._inverse(matrix - np.diag(problem.diagonal(added)), motions)
            given = part / self._largest(inverse, left, weights) * np.maximum(weights[left], 1e-12)
            enough = given >= need[left]
            if not enough.any():
                added[left] = given
                break
            added[left[enough]] = need[left[enough]]
            left = left[~enough]
        radii = self._radii(self._inverse(matrix - np.diag(problem.diagonal(added)), motions))
        return Curvature(added=added - own, radii=np.where(self._moved(motions), np.inf, radii), range_radii=radii)

    def _own(self, low: Array, slope: Array, drops: Mask) -> Array:
        """How much of its curvature each law gives to S, (n + m,); a law of a length must still rise then."""
        problem, n = self._problem, self._problem.size
        own = np.where(np.isfinite(slope), np.maximum(slope, 0.0), 0.0)
        if not len(problem.lengths):
            return own
        at = low[n:]
        rate, _ = problem.arcs.rates(low)
        secant = np.divide(np.maximum(rate[n:], 0.0), at, out=np.full_like(at, np.inf), where=at > 0.0)
        own[n:] = np.where(problem.lengths.opens | drops[n:], 0.0, np.minimum(own[n:], secant))
        return own

    def _inverse(self, matrix: Array, motions: Array) -> Array:
        """The inverse of a matrix that is made regular along rigid motions."""
        return np.asarray(np.linalg.inv(matrix + self._scale * motions @ motions.T), dtype=np.float64)

    def _moved(self, motions: Array) -> Mask:
        """Which arguments a rigid motion moves, (n + m,)."""
        lengths = self._problem.lengths
        unknowns = np.any(np.abs(motions) > 1e-9, axis=1)
        return np.concatenate([unknowns, np.any(unknowns[lengths.unknowns] & lengths.there, axis=1)])

    def _largest(self, inverse: Array, left: Integers, weights: Array) -> float:
        """The largest share θ has θ times this eigenvalue = 1: of S⁻¹ on the weighted components of some arguments."""
        problem, n = self._problem, self._problem.size
        q = np.sqrt(np.maximum(weights, 1e-12))
        vectors = left[left >= n] - n
        there = problem.lengths.there[vectors]
        rows = np.concatenate([left[left < n], problem.lengths.unknowns[vectors][there]])
        sizes = (q[n + vectors, None] * np.abs(problem.lengths.factors[vectors]))[there]
        scale = np.concatenate([q[left[left < n]], sizes])
        return float(np.linalg.eigvalsh(scale[:, None] * inverse[np.ix_(rows, rows)] * scale)[-1])

    def _radii(self, inverse: Array) -> Array:
        lengths = self._problem.lengths
        blocks = inverse[lengths.unknowns[:, :, None], lengths.unknowns[:, None, :]]
        blocks = lengths.factors[:, :, None] * blocks * lengths.factors[:, None, :]
        squares = np.concatenate([np.diag(inverse), np.linalg.eigvalsh(blocks)[:, -1]])
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)))

    def _free_motions(self, own: Array) -> Array:
        """The kernel of S + diag(own), orthonormal columns."""
        motions = self._kernel
        if not motions.shape[1]:
            return motions
        values, vectors = np.linalg.eigh(motions.T @ (own[:, None] * motions))
        return np.asarray(motions @ vectors[:, values <= REGULAR * self._scale])
