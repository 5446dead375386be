"""A lower bound of the energy on a box from any point, with laws of lengths: the Fenchel dual, in floating point.

With A = S - D positive semidefinite, ½ yᵀAy ≥ xᵀAy - ½ xᵀAx for all y, so that the energy is nowhere below
-½ xᵀAx + Σ min (φᵢ + ½ dᵢ t² - qᵢ t), each minimum over the interval of one argument alone. With g = f - Ax the force
qᵢ is gᵢ for an unknown; for a length it is the size of the forces along its vector, without those that press an opening
shut. Bounds enter with multipliers. It holds for any x; no property of envelopes is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .scalar_problem import ScalarProblem


@dataclass(frozen=True, kw_only=True)
class DualBound:
    """The bound on one box.

    Attributes:
        problem: the problem.
        low: of the box, finite, (n + m,).
        high: of the box, finite, (n + m,).
        added: d, (n + m,).
    """

    problem: ScalarProblem
    low: Array
    high: Array
    added: Array

    def at(self, x: Array, multipliers: Array) -> float:
        """The bound from a point, without the problem's constant.

        Args:
            x: the point, (n,).
            multipliers: of the problem's bounds, positive at lower ones, negative at upper ones, (n,).
        """
        problem, n = self.problem, self.problem.size
        pull = problem.stiffness @ x - problem.diagonal(self.added) * x
        force = problem.force - pull + multipliers
        along = problem.lengths.along(force)
        own = force.copy()
        own[problem.lengths.members] = 0.0
        q = np.concatenate([own, np.linalg.norm(problem.lengths.felt(along), axis=1)])
        values, places = problem.arcs.least(self.low, self.high, self.added, q)
        held = np.where(multipliers != 0.0, np.where(multipliers > 0.0, problem.lower, problem.upper), 0.0)
        shut = self._shut(along)
        bound = -0.5 * x @ pull + values.sum() + shut.sum() + multipliers @ held
        parts = np.abs(values) + np.abs(q * places) + np.abs(0.5 * self.added * places * places)
        return float(bound - self._safety(x, parts.sum() + np.abs(shut).sum() + np.abs(multipliers * held).sum(), n))

    def _shut(self, along: Array) -> Array:
        """The least of ½ d t² - g t over negative openings t, (m,)."""
        lengths, n = self.problem.lengths, self.problem.size
        g, d = np.where(lengths.opens, np.minimum(along[:, 0], 0.0), 0.0), self.added[n:]
        ends = np.stack([lengths.vectors(self.low[:n])[:, 0], lengths.vectors(self.high[:n])[:, 0]])
        end = np.minimum(ends.min(axis=0), 0.0)
        at = np.maximum(np.divide(g, d, out=np.array(end), where=d > 0.0), end)
        return np.asarray(np.where(g < 0.0, (0.5 * d * at - g) * at, 0.0))

    def _safety(self, x: Array, parts: float, n: int) -> float:
        """Machine epsilon times the number of unknowns times the sizes of all terms, at x and at the box's far end."""
        problem = self.problem
        farthest = np.maximum(np.abs(self.low[:n]), np.abs(self.high[:n]))
        pulls = np.abs(problem.stiffness) @ np.abs(x) + np.abs(problem.diagonal(self.added) * x)
        sizes = (pulls + np.abs(problem.force)) @ farthest + 0.5 * pulls @ np.abs(x) + parts
        return float(np.finfo(float).eps * (n + len(problem.lengths)) * sizes)
