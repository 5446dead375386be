"""What the balance of forces, weighed by displacements, proves of a cell: no stationary point, or a smaller cell.

Each stationary point x with tractions t has (x + y)·(Sx + t - f) = 0 for all weights y; what bounds bear adds nothing
negative if y is at most -b at a lower bound b, and at least at an upper one. With a diagonal D for which M = S - D is
positive semidefinite, and any point p, xᵀMx is at least 2 pᵀMx - pᵀMp. So the sum of hᵢ(xᵢ, tᵢ) over all laws, with

    hᵢ = dᵢ xᵢ² + xᵢ tᵢ + (2Mp + Sy - f)ᵢ xᵢ + yᵢ tᵢ,

is at most pᵀMp + y·f. On each arc hᵢ is a parabola, so its least value is known. Weights and point may come from
anywhere; the rounding of all products is allowed for, and how far M may be off positive semidefinite.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from ..typing import Array, Mask
from .scalar_problem import ScalarProblem
from .thresholds import EPSILON, LIMITS


@dataclass(frozen=True, kw_only=True)
class Split:
    """S = M + D on a cell.

    Attributes:
        diagonal: d, (n,).
        matrix: M, (n, n).
        short: M is at least minus this.
    """

    diagonal: Array
    matrix: Array
    short: float

    @classmethod
    def of(cls, problem: ScalarProblem, diagonal: Array) -> Split:
        """M = S - D, if its factorisation ends; else with the negative part of D alone.

        The factors of M + δ are exact for a matrix that is off by n machine epsilons of the trace (Rump 2006, BIT 46).

        Args:
            problem: the problem.
            diagonal: d, (n,).
        """
        for d in (diagonal, np.minimum(diagonal, 0.0)):
            matrix = problem.stiffness - np.diag(d)
            short = (len(d) + 2) * EPSILON * float(np.abs(np.diag(problem.stiffness)).sum() + np.abs(d).sum())
            try:
                cholesky(matrix + short * np.eye(len(d)), lower=True)
                break
            except LinAlgError:
                continue
        else:
            short = np.inf
        return cls(diagonal=d, matrix=matrix, short=2.0 * short)


@dataclass(frozen=True, kw_only=True)
class Graphs:
    """The arcs of all laws in a cell: their tractions are offset + slope x from begin to end, (n, m) each."""

    begin: Array
    end: Array
    meets: Mask
    offset: Array
    slope: Array

    @classmethod
    def of(cls, problem: ScalarProblem, low: Array, high: Array) -> Graphs:
        """The arcs that have more than a point in common with a cell; at a joint alone all that meet there.

        Args:
            problem: the problem.
            low: of the cell, (n,), finite.
            high: of the cell, (n,), finite.
        """
        arcs = problem.arcs
        begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
        meets = arcs.meets(low, high) | ((low == high)[:, None] & (begin <= end))
        return cls(
            begin=np.where(meets, begin, 0.0),
            end=np.where(meets, end, 0.0),
            meets=meets,
            offset=arcs.offsets,
            slope=arcs.slopes,
        )

    def size(self) -> Array:
        """The largest sum of the parts of a traction, (n,)."""
        far = np.maximum(np.abs(self.begin), np.abs(self.end))
        return np.where(self.meets, np.abs(self.offset) + np.abs(self.slope) * far, 0.0).max(axis=1)


@dataclass(frozen=True, kw_only=True)
class Weighed:
    """The parabolas h of a cell for some weights: a x² + b x + c on each arc.

    Attributes:
        graphs: the arcs.
        a: (n, m).
        b: (n, m).
        c: (n, m).
        least: the least of each h, (n,).
        total: the sum of all least values, less what it may be at a stationary point, and less its rounding;
            above zero no stationary point is in the cell.
        rounding: what was taken off for it.
    """

    graphs: Graphs
    a: Array
    b: Array
    c: Array
    least: Array
    total: float
    rounding: float

    def smaller(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        """A smaller cell: h is nowhere larger than what all other laws leave it; None if nothing is left.

        Args:
            low: of the cell, (n,).
            high: of the cell, (n,).
        """
        left = self.least - self.total + self.rounding
        first, last = self._below(left)
        first, last = first.min(axis=1), last.max(axis=1)
        if np.any(first > last):
            return None
        return widened(low, high, first, last)

    def _below(self, most: Array) -> tuple[Array, Array]:
        """The first and the last place on each arc where h is at most this; (inf, -inf) where it is nowhere."""
        begin, end, c = self.graphs.begin, self.graphs.end, self.c - most[:, None]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            root = np.sqrt(np.maximum(self.b * self.b - 4.0 * self.a * c, 0.0))
            q = -0.5 * (self.b + np.copysign(root, self.b))
            places = np.stack([begin, end, q / self.a, c / q])
            values = (self.a * places[:2] + self.b) * places[:2] + c
            holds = np.concatenate([values <= 0.0, (places[2:] >= begin) & (places[2:] <= end)])
        holds &= self.graphs.meets
        return np.where(holds, places, np.inf).min(axis=0), np.where(holds, places, -np.inf).max(axis=0)


def weighed(problem: ScalarProblem, split: Split, ends: tuple[Array, Array], weights: Array, point: Array) -> Weighed:
    """The parabolas of a cell, and what they prove.

    Args:
        problem: the problem.
        split: M and D.
        ends: of the cell, (n,) each, finite.
        weights: y, (n,); those that bounds do not allow are changed.
        point: p, (n,).
    """
    low, high = ends
    graphs, y = Graphs.of(problem, low, high), allowed(problem, low, high, weights)
    bent = split.matrix @ point
    along = 2.0 * bent + problem.stiffness @ y - problem.force
    a = split.diagonal[:, None] + graphs.slope
    b, c = graphs.offset + along[:, None] + y[:, None] * graphs.slope, y[:, None] * graphs.offset
    least = _least(graphs, a, b, c)
    off = _rounding(problem, split, graphs, (low, high), y, point)
    total = float(least.sum() - point @ bent - y @ problem.force) - off
    return Weighed(graphs=graphs, a=a, b=b, c=c, least=least, total=total, rounding=off)


def allowed(problem: ScalarProblem, low: Array, high: Array, weights: Array) -> Array:
    """Weights by which what bounds bear adds nothing negative, (n,).

    Args:
        problem: the problem.
        low: of the cell, (n,).
        high: of the cell, (n,).
        weights: (n,).
    """
    most = np.where(low <= problem.lower, -problem.lower, np.inf)
    least = np.where(high >= problem.upper, -problem.upper, -np.inf)
    return np.maximum(np.minimum(weights, most), least)


def _least(graphs: Graphs, a: Array, b: Array, c: Array) -> Array:
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        turn = np.clip(np.where(a > 0.0, -0.5 * b / a, graphs.begin), graphs.begin, graphs.end)
        values = np.stack([(a * x + b) * x + c for x in (graphs.begin, turn, graphs.end)]).min(axis=0)
    return np.where(graphs.meets, values, np.inf).min(axis=1)


def _rounding(
    problem: ScalarProblem, split: Split, graphs: Graphs, ends: tuple[Array, Array], y: Array, point: Array
) -> float:
    """What rounding, and an M that is not quite semidefinite, can be."""
    far = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    apart = np.maximum(np.abs(ends[0] - point), np.abs(ends[1] - point))
    weight, bent = np.abs(y), np.abs(split.matrix) @ np.abs(point)
    size = (3.0 * np.abs(point) + 2.0 * far) @ bent + far @ (np.abs(problem.stiffness) @ weight)
    size += (far + weight) @ (np.abs(problem.force) + graphs.size()) + np.abs(split.diagonal) @ far**2
    return LIMITS.rounding * float(size) + split.short * float(apart @ apart)


class ForceIntervals:
    """What the balance of forces leaves of a cell: Sᵢᵢxᵢ + ∂φᵢ(xᵢ) meets fᵢ - Σⱼ Sᵢⱼxⱼ, an interval.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem, diagonal = problem, np.diag(problem.stiffness).copy()
        self._graphs = GraphClip(problem, diagonal)
        others = problem.stiffness - np.diag(diagonal)
        self._positive, self._negative = np.maximum(others, 0.0), np.minimum(others, 0.0)

    def tightened(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        """A smaller cell with the same stationary points; None if there is none in it.

        Args:
            low: of the cell, (n,), finite.
            high: of the cell, (n,), finite.
        """
        return clipped_again(self._once, low, high)

    def _once(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        force = self._problem.force
        least = force - self._positive @ high - self._negative @ low
        most = force - self._positive @ low - self._negative @ high
        slack = LIMITS.rounding * (np.abs(least) + np.abs(most) + np.abs(force))
        return self._graphs.clipped(low, high, least - slack, most + slack)


Clip = Callable[[Array, Array], tuple[Array, Array] | None]
"""A pass over intervals: smaller ones, or None if one is empty."""


def clipped_again(once: Clip, low: Array, high: Array) -> tuple[Array, Array] | None:
    """What passes leave of intervals, as long as they make some of them shorter; None if one is empty.

    Args:
        once: a pass.
        low: of the intervals, (n,), finite.
        high: of the intervals, (n,), finite.
    """
    for _ in range(LIMITS.most_rounds):
        if (ends := once(low, high)) is None:
            return None
        gained = shorter(low, high, *ends).any()
        low, high = ends
        if not gained:
            break
    return low, high


def shorter(low: Array, high: Array, begin: Array, end: Array) -> Mask:
    """Which intervals are made shorter by more than a little, (n,).

    Args:
        low: where they began, (n,).
        high: where they ended, (n,).
        begin: where they begin now, (n,).
        end: where they end now, (n,).
    """
    return end - begin < (1.0 - LIMITS.worthwhile) * (high - low)


def widened(low: Array, high: Array, first: Array, last: Array) -> tuple[Array, Array]:
    """The part of intervals between two places each, and a little more.

    Args:
        low: of the intervals, (n,), finite.
        high: of the intervals, (n,), finite.
        first: the first place, (n,).
        last: the last place, (n,).
    """
    wide = np.maximum(LIMITS.rounding * (np.abs(first) + np.abs(last) + (high - low)), np.finfo(float).tiny)
    return np.maximum(low, first - wide), np.minimum(high, last + wide)


class GraphClip:
    """The graphs of a problem's laws and bounds, to which springs may be added.

    Args:
        problem: the problem.
        springs: stiffness d of the springs, (n,).
    """

    def __init__(self, problem: ScalarProblem, springs: Array) -> None:
        self._problem, self._springs, self._arcs = problem, springs, problem.arcs

    def clipped(self, low: Array, high: Array, least: Array, most: Array) -> tuple[Array, Array] | None:
        """Smaller intervals that hold all x for which d x + ∂φ(x), and what bounds bear, meets the forces.

        Args:
            low: of x, (n,), finite.
            high: of x, (n,), finite.
            least: force, (n,).
            most: force, (n,).

        Returns:
            low and high; None if one interval is empty.
        """
        column_least, column_most = least[:, None], most[:, None]
        first, last = self._on_arcs(Graphs.of(self._problem, low, high), column_least, column_most)
        joint_low, joint_high = self._at_joints(low, high, column_least, column_most)
        first = np.minimum(first.min(axis=1), joint_low)
        last = np.maximum(last.max(axis=1), joint_high)
        first, last = self._at_bounds(low, high, least, most, first, last)
        if np.any(first > last):
            return None
        return widened(low, high, first, last)

    def _on_arcs(self, graphs: Graphs, least: Array, most: Array) -> tuple[Array, Array]:
        """The ends of what is left of each arc; (inf, -inf) of those that are lost."""
        arcs, d, begin, end = self._arcs, self._springs[:, None], graphs.begin, graphs.end
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            slope = arcs.slopes + d
            at_begin = arcs.tractions + arcs.slopes * (begin - arcs.anchors) + d * begin
            at_end = at_begin + slope * (end - begin)
            to_least, to_most = begin + (least - at_begin) / slope, begin + (most - at_begin) / slope
            rises, falls = slope > 0.0, slope < 0.0
            first = np.where(rises, to_least, np.where(falls, to_most, begin))
            last = np.where(rises, to_most, np.where(falls, to_least, end))
            lost = (np.minimum(at_begin, at_end) > most) | (np.maximum(at_begin, at_end) < least) | ~graphs.meets
        first, last = np.clip(first, begin, end), np.clip(last, begin, end)
        return np.where(lost, np.inf, first), np.where(lost, -np.inf, last)

    def _at_joints(self, low: Array, high: Array, least: Array, most: Array) -> tuple[Array, Array]:
        """The first and the last joint in the box whose interval of tractions meets the forces.

        One at the end of an interval only counts where the interval is that joint alone, or the end is a bound.
        """
        arcs, d = self._arcs, self._springs[:, None]
        at = arcs.high[:, :-1]
        inside = (at > low[:, None]) & (at < high[:, None]) | (low == high)[:, None] & (at == low[:, None])
        inside |= (at == low[:, None]) & (at == self._problem.lower[:, None])
        inside |= (at == high[:, None]) & (at == self._problem.upper[:, None])
        with np.errstate(invalid="ignore"):
            a, b = arcs.before[:, :-1] + d * at, arcs.after[:, 1:] + d * at
            meets = inside & (np.minimum(a, b) <= most) & (np.maximum(a, b) >= least)
        first = np.where(meets, at, np.inf).min(axis=1, initial=np.inf)
        return first, np.where(meets, at, -np.inf).max(axis=1, initial=-np.inf)

    def _at_bounds(
        self, low: Array, high: Array, least: Array, most: Array, first: Array, last: Array
    ) -> tuple[Array, Array]:
        """The ends of the range stay where a bound can push there."""
        problem = self._problem
        for at, bound, upper in ((low, problem.lower, False), (high, problem.upper, True)):
            pull = self._arcs.rates(at) + self._springs * at
            sizes = sum(np.where(np.isfinite(part), np.abs(part), 0.0) for part in (pull, least, most))
            pushes = (most >= pull - LIMITS.rounding * sizes) if upper else (least <= pull + LIMITS.rounding * sizes)
            stays = (at == bound) & pushes
            first, last = np.where(stays, np.minimum(first, at), first), np.where(stays, np.maximum(last, at), last)
        return first, last
