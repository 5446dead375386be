"""Smaller boxes that hold the same equilibria: intervals of the forces, unknown by unknown."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..typing import Array, Mask
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


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
    return np.asarray(end - begin < (1.0 - LIMITS.worthwhile) * (high - low))


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
        column_least, column_most, arcs = least[:, None], most[:, None], self._arcs
        begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
        first, last = self._on_arcs(begin, end, column_least, column_most, arcs.meets(low, high))
        joint_low, joint_high = self._at_joints(low, high, column_least, column_most)
        first = np.minimum(first.min(axis=1), joint_low)
        last = np.maximum(last.max(axis=1), joint_high)
        first, last = self._at_bounds(low, high, least, most, first, last)
        if np.any(first > last):
            return None
        return widened(low, high, first, last)

    def _on_arcs(self, begin: Array, end: Array, least: Array, most: Array, meets: Mask) -> tuple[Array, Array]:
        """The ends of what is left of each arc; (inf, -inf) of those that are lost."""
        arcs, d = self._arcs, self._springs[:, None]
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            slope = arcs.slopes + d
            at_begin = arcs.tractions + arcs.slopes * (begin - arcs.anchors) + d * begin
            at_end = at_begin + slope * (end - begin)
            to_least, to_most = begin + (least - at_begin) / slope, begin + (most - at_begin) / slope
            rises, falls = slope > 0.0, slope < 0.0
            first = np.where(rises, to_least, np.where(falls, to_most, begin))
            last = np.where(rises, to_most, np.where(falls, to_least, end))
            lost = (np.minimum(at_begin, at_end) > most) | (np.maximum(at_begin, at_end) < least) | ~meets
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
        problem, rows, arcs = self._problem, np.arange(len(low)), self._arcs
        for at, bound, upper in ((low, problem.lower, False), (high, problem.upper, True)):
            k = arcs.at(at)
            pull = arcs.tractions[rows, k] + arcs.slopes[rows, k] * (at - arcs.anchors[rows, k]) + self._springs * at
            sizes = sum(np.where(np.isfinite(part), np.abs(part), 0.0) for part in (pull, least, most))
            pushes = (most >= pull - LIMITS.rounding * sizes) if upper else (least <= pull + LIMITS.rounding * sizes)
            stays = (at == bound) & pushes
            first, last = np.where(stays, np.minimum(first, at), first), np.where(stays, np.maximum(last, at), last)
        return first, last
