"""Curvature lent along rigid motions, where S has none, and taken back by a chord.

A rigid motion costs no elastic energy: no D > 0 of laws that it moves leaves S - D positive semidefinite. So ½ σ s² is
added, s = c·x being the motion's share, and its chord over the interval of s in the box is taken off. This lowers the
bound by σ (s₁ - s₀)²/8 at most, and the interval can be divided like that of an unknown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Mask
from .arcs import FREE, INF
from .scalar_problem import ScalarProblem
from .thresholds import DEFAULT, BoundThresholds


def shapes(problem: ScalarProblem, kernel: Array) -> Array:
    """Orthonormal columns: how rigid motions move the unknowns with laws, (n, k).

    Args:
        problem: the problem.
        kernel: the rigid motions, orthonormal columns, (n, j).
    """
    with_law = np.array([c != FREE for c in problem.chains[: problem.size]], dtype=np.bool_)
    with_law[problem.lengths.members] = True
    columns, sizes, _ = np.linalg.svd(np.where(with_law[:, None], kernel, 0.0), full_matrices=False)
    return np.asarray(columns[:, sizes > problem.thresholds.points.accuracy])


def span(moved: Array, low: Array, high: Array, widened: float) -> tuple[Array, Array]:
    """The least and the largest shares of motions in a box, (k,) each.

    Args:
        moved: the motions' shapes, (n, k).
        low: of the unknowns, (n,).
        high: of the unknowns, (n,).
        widened: relative widening, for rounding.
    """
    up, down = np.maximum(moved, 0.0).T, np.minimum(moved, 0.0).T
    least, most = up @ low + down @ high, up @ high + down @ low
    slack = widened * (np.abs(moved).T @ np.maximum(np.abs(low), np.abs(high)))
    return np.asarray(least - slack), np.asarray(most + slack)


def farthest_joints(problem: ScalarProblem, moved: Array) -> Array:
    """The largest shares of motions at which laws have joints, (k,); inf where there are none.

    Args:
        problem: the problem.
        moved: the motions' shapes, (n, k).
    """
    lengths, n = problem.lengths, problem.size
    ends = np.array([max((abs(a.low) for a in c if abs(a.low) < INF), default=0.0) for c in problem.chains])
    reach = ends[:n].copy()
    factors = np.abs(lengths.factors)
    reach[lengths.members] = np.divide(ends[n:, None], factors, out=np.zeros_like(factors), where=lengths.there)[
        lengths.there
    ]
    result = np.abs(moved).T @ reach
    return np.asarray(np.where(result > 0.0, result, np.inf))


def long(low: Array, high: Array, joints: Array, growth: float) -> Mask:
    """Which intervals of shares reach far behind the laws' joints, (k,).

    Args:
        low: their begins, (k,).
        high: their ends, (k,).
        joints: the farthest joints, (k,).
        growth: so many times farther than where they begin is far.
    """
    return np.asarray(
        (high > growth * np.maximum(low, joints)) | (-low > growth * np.maximum(-high, joints)), dtype=np.bool_
    )


def divided(low: float, high: float, joint: float, at: float, thresholds: BoundThresholds = DEFAULT.bounds) -> float:
    """Where the interval of a share is divided: what is far behind the joints apart, and in growing parts.

    Args:
        low: its begin.
        high: its end.
        joint: the farthest joint.
        at: where it is divided best, if it is not long.
        thresholds: how the parts grow.
    """
    growth = thresholds.growth
    for sign, begin, end in ((1.0, low, high), (-1.0, -high, -low)):
        if end > growth * max(begin, joint):
            return sign * (growth * begin if begin >= joint else joint)
    first, last = (low + share * (high - low) for share in thresholds.middle)
    return min(max(at, first), last)


@dataclass(frozen=True, kw_only=True)
class Lent:
    """Curvature along motions, without its chords.

    Attributes:
        shapes: of the motions, (n, k).
        stiffness: σ, (k,).
        low: begin of the interval of each share, (k,).
        high: end of it, (k,).
    """

    shapes: Array
    stiffness: Array
    low: Array
    high: Array

    @property
    def matrix(self) -> Array:
        """What is added to S, (n, n)."""
        return np.asarray((self.shapes * self.stiffness) @ self.shapes.T)

    @property
    def force(self) -> Array:
        """What the chords add to f, (n,)."""
        return np.asarray(self.shapes @ (self.stiffness * 0.5 * (self.low + self.high)))

    @property
    def constant(self) -> float:
        """What the chords add to the energy, less its rounding."""
        parts = 0.5 * self.stiffness * self.low * self.high
        return float(parts.sum() - np.finfo(float).eps * len(self.shapes) * np.abs(parts).sum())

    def pull(self, x: Array) -> Array:
        """The force of the curvature, (n,).

        Args:
            x: a point, (n,).
        """
        return np.asarray(self.shapes @ (self.stiffness * (self.shapes.T @ x)))

    def size(self, x: Array) -> Array:
        """The sizes of the terms of all these forces, (n,).

        Args:
            x: a point, (n,).
        """
        each = np.abs(self.shapes)
        ends = np.maximum(np.abs(self.low), np.abs(self.high))
        return np.asarray(each @ (self.stiffness * (each.T @ np.abs(x) + ends)))

    def gaps(self, x: Array) -> Array:
        """What the chords take off at a point, (k,).

        Args:
            x: the point, (n,).
        """
        s = self.shapes.T @ x
        return np.asarray(0.5 * self.stiffness * np.maximum((s - self.low) * (self.high - s), 0.0))
