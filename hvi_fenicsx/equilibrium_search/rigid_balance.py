"""Smaller cells by the balance of whole bodies: net forces and moments, and the elastic part of the displacement.

With τ = f - Sx the forces that laws and bounds bear, a rigid motion r (Sr = 0) demands r·τ = r·f. And
x = Tx_p + G(f - τ), where x_p are a few unknowns, pivots, that fix the rigid motion T x_p. So intervals of the forces,
which also cells that reach far have, bound the differences of displacements to those of the pivots.

Eigenvectors only tell how many pivots there are. Elastic forces have no net force, so the blocks of S at the pivots
are made anew from the block of the others, such that S T = 0; what Sr is off zero by rounding is taken for zero.
Else a body a million slips away would be held by rounding, where a load that is above its limit by 1e-7 pulls. What is
beyond rounding counts, and so does what I - T_p - GS is off zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from ..typing import Array, Integers
from .scalar_problem import ScalarProblem
from .thresholds import EPSILON, LIMITS
from .weighed_balance import GraphClip, Graphs, clipped_again


@dataclass(frozen=True, kw_only=True)
class RigidMotions:
    """The motions T x_p, to which S is no resistance but for rounding.

    Attributes:
        pivots: unknowns that fix the motion, (k,).
        others: all other unknowns, (n - k,).
        shapes: T, (n, k).
    """

    pivots: Integers
    others: Integers
    shapes: Array

    @classmethod
    def of(cls, stiffness: Array) -> RigidMotions:
        """The motions of a stiffness.

        Args:
            stiffness: S, (n, n).
        """
        rigid = kernel(stiffness)
        n, k = rigid.shape
        pivots = np.asarray(qr(rigid.T, pivoting=True, mode="r")[1][:k], dtype=np.int64)
        others = np.setdiff1d(np.arange(n), pivots)
        shapes = np.zeros((n, k))
        shapes[pivots] = np.eye(k)
        shapes[others] = -np.linalg.solve(stiffness[np.ix_(others, others)], stiffness[np.ix_(others, pivots)])
        return cls(pivots=pivots, others=others, shapes=shapes)


def kernel(stiffness: Array) -> Array:
    """Orthonormal columns that a stiffness maps to zero, (n, k).

    Args:
        stiffness: S, (n, n).
    """
    values, vectors = np.linalg.eigh(stiffness)
    return vectors[:, values <= LIMITS.zero * np.max(values, initial=0.0)]


def resistance(stiffness: Array, shapes: Array) -> tuple[Array, Array]:
    """How much a stiffness resists motions, and the size of its rounding, (n, k) each.

    Args:
        stiffness: S, (n, n).
        shapes: T, (n, k).
    """
    return np.abs(stiffness @ shapes), len(stiffness) * LIMITS.rounding * (np.abs(stiffness) @ np.abs(shapes))


def without_resistance(stiffness: Array) -> Array:
    """A stiffness that does not resist its rigid motions; the given one where they may be deformations.

    Shares of a motion that are next to 0, 1 or -1 are these numbers.

    Args:
        stiffness: S, symmetric, (n, n).
    """
    motions = RigidMotions.of(stiffness)
    found, rounding = resistance(stiffness, motions.shapes)
    if np.any(found > rounding):
        return stiffness
    others, pivots, shapes = motions.others, motions.pivots, motions.shapes[motions.others]
    whole = np.round(shapes)
    shapes = np.where(np.abs(shapes - whole) < LIMITS.accuracy, whole, shapes)
    result, scale = stiffness.copy(), np.sqrt(np.diag(stiffness))
    between = -stiffness[np.ix_(others, others)] @ shapes
    result[np.ix_(others, pivots)], result[np.ix_(pivots, others)] = between, between.T
    own = -shapes.T @ between
    result[np.ix_(pivots, pivots)] = 0.5 * (own + own.T)
    near = np.all(np.abs(result - stiffness) <= LIMITS.zero * np.outer(scale, scale))
    return result if near else stiffness


class RigidBalance:
    """What net balance and elasticity leave of a cell.

    Args:
        problem: the problem.

    Attributes:
        pivots: unknowns that fix the rigid motions, one for each.
        motions: T, (n, k).
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem, n = problem, problem.size
        self._graphs = GraphClip(problem, np.zeros(n))
        motions = RigidMotions.of(problem.stiffness)
        self.pivots: Integers = motions.pivots
        self.motions: Array = motions.shapes
        others = np.ix_(motions.others, motions.others)
        self._flexibility = np.zeros((n, n))
        self._flexibility[others] = np.linalg.inv(problem.stiffness[others])
        found, rounding = resistance(problem.stiffness, motions.shapes)
        self._net = np.where(found <= rounding, 0.0, found + rounding)
        self._rest = self._error()
        self._exact = bool(not self._net.any() and self._rest.sum(axis=1).max() < 0.5)

    def _error(self) -> Array:
        """How far G is off the inverse on elastic parts, for exact numbers, rounding included, (n, n)."""
        stiffness, n = self._problem.stiffness, self._problem.size
        rest = np.eye(n) - self._flexibility @ stiffness
        rest[:, self.pivots] -= self.motions
        sizes = np.eye(n) + np.abs(self._flexibility) @ np.abs(stiffness)
        sizes[:, self.pivots] += np.abs(self.motions)
        return np.abs(rest) + n * EPSILON * sizes

    def tightened(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        """A smaller cell with the same stationary points; None if there is none in it.

        Args:
            low: of the cell, (n,), finite.
            high: of the cell, (n,), finite.
        """
        return clipped_again(self._once, low, high)

    def _once(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        if (forces := self._balanced(*self._forces(low, high), low, high)) is None:
            return None
        rounding = LIMITS.rounding * sum(np.where(np.isfinite(part), np.abs(part), 0.0) for part in forces)
        ends = self._graphs.clipped(low, high, forces[0] - rounding, forces[1] + rounding)
        if ends is None or not np.all(np.isfinite(forces)):
            return ends
        return self._moved(*ends, *self._elastic_parts(*ends, *forces))

    def _forces(self, low: Array, high: Array) -> tuple[Array, Array]:
        """What laws and bounds can bear in a cell, (n,) each; infinite where a bound can push."""
        problem, arcs = self._problem, self._problem.arcs
        graphs = Graphs.of(problem, low, high)
        ends = np.stack([arcs.tractions + arcs.slopes * (at - arcs.anchors) for at in (graphs.begin, graphs.end)])
        least = np.where(graphs.meets, ends.min(axis=0), np.inf).min(axis=1)
        most = np.where(graphs.meets, ends.max(axis=0), -np.inf).max(axis=1)
        wide = LIMITS.rounding * (np.abs(least) + np.abs(most))
        least, most = least - wide, most + wide
        return np.where(low <= problem.lower, -np.inf, least), np.where(high >= problem.upper, np.inf, most)

    def _balanced(self, least: Array, most: Array, low: Array, high: Array) -> tuple[Array, Array] | None:
        """Smaller intervals of the forces: the net force along each rigid motion is that of the load."""
        force, size = self._problem.force, np.maximum(np.abs(low), np.abs(high))
        for j in range(len(self.pivots)):
            motion, net = self.motions[:, j], self._net[:, j]
            i = np.flatnonzero(motion)
            r = motion[i]
            ends = np.sort(np.stack([r * least[i], r * most[i]]), axis=0)
            finite = np.where(np.isfinite(ends), np.abs(ends), 0.0).max(axis=0)
            error = float(net @ size) + len(force) * EPSILON * float(np.abs(motion) @ np.abs(force) + finite.sum())
            total = float(motion @ force)
            new = np.stack([total - error - _sum_of_others(ends[1]), total + error - _sum_of_others(ends[0])])
            new = np.sort(new / r, axis=0)
            least[i], most[i] = np.maximum(least[i], new[0]), np.minimum(most[i], new[1])
        return None if np.any(least > most) else (least, most)

    def _moved(self, low: Array, high: Array, first: Array, last: Array) -> tuple[Array, Array] | None:
        """Smaller intervals of the displacements x = T x_p + e, by those of e; None if one is empty."""
        begin, end = low[self.pivots], high[self.pivots]
        for j in range(len(begin)):
            motion = self.motions[:, j]
            i = np.flatnonzero(motion)
            others = np.delete(np.arange(len(begin)), j)
            rest_low, rest_high = _product(self.motions[np.ix_(i, others)], begin[others], end[others])
            ways = np.sort(np.stack([low[i] - last[i] - rest_high, high[i] - first[i] - rest_low]) / motion[i], axis=0)
            slack = LIMITS.rounding * np.abs(np.stack([low[i], high[i], first[i], last[i]]) / motion[i]).max()
            begin[j], end[j] = max(begin[j], ways[0].max() - slack), min(end[j], ways[1].min() + slack)
        if np.any(begin > end):
            return None
        moved_low, moved_high = _product(self.motions, begin, end)
        slack = LIMITS.rounding * (np.abs(moved_low) + np.abs(moved_high) + np.abs(first) + np.abs(last))
        low, high = np.maximum(low, moved_low + first - slack), np.minimum(high, moved_high + last + slack)
        return None if np.any(low > high) else (low, high)

    def _elastic_parts(self, low: Array, high: Array, least: Array, most: Array) -> tuple[Array, Array]:
        """The intervals of e, made short: G is changed along rigid motions, where the net force is known."""
        problem, motions, n = self._problem, self.motions, self._problem.size
        weights = (most - least) ** 2 + 1e-300
        normal = motions.T @ (weights[:, None] * motions)
        shift = -np.linalg.lstsq(normal, (self._flexibility * weights @ motions).T, rcond=None)[0].T
        flexibility = self._flexibility + shift @ motions.T
        rows, middle = flexibility * (0.5 * (most - least)), flexibility @ (problem.force - 0.5 * (least + most))
        reach = np.abs(rows).sum(axis=1)
        size = np.maximum(np.abs(low), np.abs(high))
        if self._exact:  # then only e is off, by less than itself
            size = np.minimum(size, 2.0 * np.max(np.abs(middle) + reach))
        forces = np.abs(problem.force) + np.maximum(np.abs(least), np.abs(most))
        sizes = np.abs(self._flexibility) @ forces + np.abs(shift) @ (np.abs(motions.T) @ forces)
        error = self._rest @ size + np.abs(shift) @ (self._net.T @ size) + n * EPSILON * sizes
        reach = reach + error
        return middle - reach, middle + reach


def _product(matrix: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """The ends of matrix @ [low, high]."""
    plus, minus = np.maximum(matrix, 0.0), np.minimum(matrix, 0.0)
    return plus @ low + minus @ high, plus @ high + minus @ low


def _sum_of_others(parts: Array) -> Array:
    """For each part the sum of all others, some of which may be infinite."""
    infinite = ~np.isfinite(parts)
    if not infinite.any():
        return parts.sum() - parts
    sign = parts[infinite][0]
    finite = np.where(infinite, 0.0, parts)
    alone = infinite.sum() - infinite
    return np.where(alone > 0, sign, finite.sum() - finite)
