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

from ..typing import Array, Integers
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
        added: d, which is negative where the law's own slope is given to S, (n,).
        radii: half widths (n,) of what strong convexity allows for a gap of ½; inf where a rigid motion moves.
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
            low: of the box, (n,).
            high: of the box, (n,).
            undecided: unknowns whose law is not convex on the box.
            weights: how much of D each of these is to have, (n,).
            part: the share of the largest D of that kind that is taken, below 1.
        """
        arcs, n = self._problem.arcs, self._problem.size
        slope = arcs.least_slope(low, high)
        own = np.where(np.isfinite(slope), np.maximum(slope, 0.0), 0.0)
        matrix = self._problem.stiffness + np.diag(own)
        motions = self._free_motions(own)
        need = np.where(arcs.drops(low, high) > 0.0, np.inf, np.maximum(-slope, 0.0))
        added = np.zeros(n)
        left = undecided[np.all(np.abs(motions[undecided]) <= 1e-9, axis=1)]
        for _ in range(MOST_ROUNDS):
            if not left.size:
                break
            inverse = np.linalg.inv(matrix - np.diag(added) + self._scale * motions @ motions.T)
            q = np.sqrt(np.maximum(weights[left], 1e-12))
            given = part / float(np.linalg.eigvalsh(q[:, None] * inverse[np.ix_(left, left)] * q)[-1]) * q * q
            enough = given >= need[left]
            if not enough.any():
                added[left] = given
                break
            added[left[enough]] = need[left[enough]]
            left = left[~enough]
        inverse = np.linalg.inv(matrix - np.diag(added) + self._scale * motions @ motions.T)
        radii = np.sqrt(np.maximum(np.diag(inverse), 0.0))
        moved = np.any(np.abs(motions) > 1e-9, axis=1)
        return Curvature(added=added - own, radii=np.where(moved, np.inf, radii), range_radii=radii)

    def _free_motions(self, own: Array) -> Array:
        """The kernel of S + diag(own), orthonormal columns."""
        motions = self._kernel
        if not motions.shape[1]:
            return motions
        values, vectors = np.linalg.eigh(motions.T @ (own[:, None] * motions))
        return np.asarray(motions @ vectors[:, values <= REGULAR * self._scale])
