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
from .motions import Lent
from .scalar_problem import ScalarProblem


@dataclass(frozen=True, kw_only=True)
class DualBound:
    """The bound on one box.

    Attributes:
        problem: the problem.
        low: of the box, finite, (n + m,).
        high: of the box, finite, (n + m,).
        added: d, (n + m,).
        lent: curvature along rigid motions.
    """

    problem: ScalarProblem
    low: Array
    high: Array
    added: Array
    lent: Lent

    def at(self, x: Array, multipliers: Array) -> float:
        """The bound from a point, without the problem's constant.

        Args:
            x: the point, (n,).
            multipliers: of the problem's bounds, positive at lower ones, negative at upper ones, (n,).
        """
        problem, lengths = self.problem, self.problem.lengths
        pull = problem.stiffness @ x - problem.diagonal(self.added) * x + self.lent.pull(x)
        force = problem.force + self.lent.force - pull + multipliers
        error = self._rounding * self._sizes(x, multipliers)
        along, slack = lengths.along(force), np.abs(lengths.along(error))
        own = force.copy()
        own[lengths.members] = error[lengths.members] = 0.0
        q = np.concatenate([own, np.linalg.norm(lengths.felt(along), axis=1)])
        values, parts = self._least(q, np.concatenate([error, np.linalg.norm(slack, axis=1)]))
        held = np.where(multipliers != 0.0, np.where(multipliers > 0.0, problem.lower, problem.upper), 0.0)
        shut = self._shut(along - slack)
        bound = -0.5 * x @ pull + values.sum() + shut.sum() + multipliers @ held + self.lent.constant
        parts += float(np.abs(shut).sum() + np.abs(multipliers * held).sum())
        parts += 0.5 * float(np.abs(x) @ self._sizes(x, multipliers))
        return float(bound - self._rounding * parts)

    def _least(self, q: Array, error: Array) -> tuple[Array, float]:
        """The least terms for all forces near q, which are concave in the force, and the sum of their parts' sizes."""
        problem = self.problem
        (first, at), (second, other) = (
            problem.arcs.least(self.low, self.high, self.added, q + sign * error) for sign in (-1.0, 1.0)
        )
        values, places = np.minimum(first, second), np.maximum(np.abs(at), np.abs(other))
        sizes = np.abs(values) + np.abs(q * places) + np.abs(0.5 * self.added * places * places)
        return values, float(sizes.sum())

    def _shut(self, along: Array) -> Array:
        """The least of ½ d t² - g t over negative openings t, (m,)."""
        lengths, n = self.problem.lengths, self.problem.size
        g, d = np.where(lengths.opens, np.minimum(along[:, 0], 0.0), 0.0), self.added[n:]
        ends = np.stack([lengths.vectors(self.low[:n])[:, 0], lengths.vectors(self.high[:n])[:, 0]])
        end = np.minimum(ends.min(axis=0), 0.0)
        at = np.maximum(np.divide(g, d, out=np.array(end), where=d > 0.0), end)
        return np.asarray(np.where(g < 0.0, (0.5 * d * at - g) * at, 0.0))

    @property
    def _rounding(self) -> float:
        """What a sum of as many terms as there are unknowns is off at most, relative to their sizes."""
        return float(np.finfo(float).eps) * (self.problem.size + len(self.problem.lengths))

    def _sizes(self, x: Array, multipliers: Array) -> Array:
        """The sizes of all terms of the forces at a point, (n,)."""
        problem = self.problem
        elastic = np.abs(problem.stiffness) @ np.abs(x) + np.abs(problem.diagonal(self.added) * x)
        return np.asarray(elastic + self.lent.size(x) + np.abs(problem.force) + np.abs(multipliers))
