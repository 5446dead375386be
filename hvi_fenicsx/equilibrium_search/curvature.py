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
from . import motions
from .scalar_problem import ScalarProblem


def kernel(problem: ScalarProblem) -> Array:
    """Orthonormal columns that S maps to zero, (n, k).

    Args:
        problem: the problem with S.
    """
    values, vectors = eigh(problem.stiffness)
    return np.asarray(vectors[:, values <= problem.thresholds.points.zero * max(float(values[-1]), 0.0)])


@dataclass(frozen=True, kw_only=True)
class Curvature:
    """The diagonal D of one box.

    Attributes:
        added: d, which is negative where the law's own slope is given to S, (n + m,).
        radii: half widths (n + m,) of what strong convexity allows for a gap of ½; inf where a rigid motion moves.
        range_radii: the same of displacements without rigid motions.
        lent: σ along the shapes of rigid motions, (k,).
        share_radii: half widths of the motions' shares, (k,).
        follow: how the unknowns move with the shares, (n, k).
        apart: half widths (n,) of displacements at given shares, like the radii.
    """

    added: Array
    radii: Array
    range_radii: Array
    lent: Array
    share_radii: Array
    follow: Array
    apart: Array


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
        return kernel(self._problem)

    @cached_property
    def shapes(self) -> Array:
        """How rigid motions move the unknowns with laws, (n, k)."""
        return motions.shapes(self._problem, self._kernel)

    @cached_property
    def springs(self) -> Array:
        """A matrix as stiff as S that resists these motions alone, (n, n)."""
        return np.asarray(self._scale * self.shapes @ self.shapes.T)

    def at_rest(self, x: Array) -> Array:
        """A point without its rigid motions of unknowns with laws, (n,).

        Args:
            x: the point, (n,).
        """
        return np.asarray(x - self._kernel @ np.linalg.pinv(self.shapes.T @ self._kernel) @ (self.shapes.T @ x))

    def share(
        self, low: Array, high: Array, undecided: Integers, weights: Array, part: float, *, lend: bool = False
    ) -> Curvature:
        """D on a box.

        Args:
            low: of the box, (n + m,).
            high: of the box, (n + m,).
            undecided: arguments whose law is not convex on the box.
            weights: how much of D each of these is to have, (n + m,).
            part: the share of the largest D of that kind that is taken, below 1.
            lend: whether curvature is lent along rigid motions.
        """
        problem = self._problem
        slope = problem.arcs.least_slope(low, high)
        drops = problem.arcs.drops(low, high) > 0.0
        own = self._own(low, slope, drops)
        lent: Array = np.full(self.shapes.shape[1], self._scale if lend else 0.0)
        along = np.diag(problem.diagonal(own)) + (self.shapes * lent) @ self.shapes.T
        free = self._free_motions(along)
        need = np.where(drops, np.inf, np.maximum(-slope, 0.0))
        added = self._given(problem.stiffness + along, free, undecided, weights, need, part)
        matrix = problem.stiffness + along - np.diag(problem.diagonal(added))
        inverse = self._inverse(matrix, free)
        if lent.any():
            lent, matrix = self._needed(lent, matrix, inverse)
            inverse = self._inverse(matrix, free)
        follow, apart = self._at_given_shares(matrix, along)
        radii = self._radii(inverse)
        shares = np.sqrt(np.einsum("ik,ij,jk->k", self.shapes, inverse, self.shapes))
        return Curvature(
            added=added - own,
            radii=np.where(self._moved(free), np.inf, radii),
            range_radii=radii,
            lent=lent,
            share_radii=np.where(np.any(np.abs(self.shapes.T @ free) > 1e-9, axis=1), np.inf, shares),
            follow=follow,
            apart=apart,
        )

    def _at_given_shares(self, matrix: Array, along: Array) -> tuple[Array, Array]:
        """How unknowns move with the shares of rigid motions, and what strong convexity allows them besides."""
        if not self.shapes.size:
            return self.shapes, np.full(len(matrix), np.inf)
        free = self._free_motions(along + self.springs)
        inverse = self._inverse(matrix + self.springs, free)
        moved = inverse @ self.shapes
        follow = np.asarray(np.linalg.solve(self.shapes.T @ moved, moved.T).T)
        squares = np.diag(inverse) - np.einsum("ik,ik->i", follow, moved)
        apart = np.sqrt(np.maximum(squares, 0.0))
        return follow, np.asarray(np.where(np.any(np.abs(free) > 1e-9, axis=1), np.inf, apart))

    def _given(
        self, matrix: Array, free: Array, undecided: Integers, weights: Array, need: Array, part: float
    ) -> Array:
        """D, (n + m,): in proportion to the weights, but no more than is needed."""
        added = np.zeros(len(weights))
        left = undecided[~self._moved(free)[undecided]]
        for _ in range(self._problem.thresholds.cells.most_rounds):
            if not left.size:
                break
            inverse = self._inverse(matrix - np.diag(self._problem.diagonal(added)), free)
            given = part / self._largest(inverse, left, weights) * np.maximum(weights[left], 1e-12)
            enough = given >= need[left]
            if not enough.any():
                added[left] = given
                break
            added[left[enough]] = need[left[enough]]
            left = left[~enough]
        return added

    def _needed(self, lent: Array, matrix: Array, inverse: Array) -> tuple[Array, Array]:
        """What S - D needs of the curvature lent, and S - D with it."""
        columns = self.shapes * np.sqrt(lent)
        limit = self._problem.thresholds.bounds.spared
        spared = min(1.0, limit / max(float(np.linalg.eigvalsh(columns.T @ inverse @ columns)[-1]), limit))
        return (1.0 - spared) * lent, matrix - spared * columns @ columns.T

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

    def _free_motions(self, along: Array) -> Array:
        """The rigid motions that a matrix does not resist, orthonormal columns."""
        rigid = self._kernel
        if not rigid.shape[1]:
            return rigid
        values, vectors = np.linalg.eigh(rigid.T @ along @ rigid)
        zero = self._problem.thresholds.points.zero
        return np.asarray(rigid @ vectors[:, values <= zero * self._scale])
