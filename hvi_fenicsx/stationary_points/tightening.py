"""Smaller boxes that hold the same equilibria: intervals of the forces, unknown by unknown."""

from __future__ import annotations

import numpy as np

from ..typing import Array, Mask
from .scalar_problem import ArcTable, ScalarProblem

MOST_ROUNDS = 8
"""Passes over all unknowns."""
PROGRESS = 1e-3
"""A pass that makes no interval shorter by this share is the last."""
WIDENED = 1e-12
"""Relative widening of what is found, for rounding."""


class ForceIntervals:
    """What the balance of forces leaves of a box: Sᵢᵢxᵢ + ∂φᵢ(xᵢ) meets fᵢ - Σⱼ Sᵢⱼxⱼ, an interval.

    Args:
        problem: the problem.
        joints_at_ends: whether a joint at the end of an interval counts with all its tractions; if not, only where the
            interval is that joint alone.
    """

    def __init__(self, problem: ScalarProblem, *, joints_at_ends: bool = True) -> None:
        self._problem, self._joints_at_ends = problem, joints_at_ends
        self._arcs = ArcTable.of(problem.chains[: problem.size])
        self._diagonal = np.diag(problem.stiffness).copy()
        others = problem.stiffness - np.diag(self._diagonal)
        self._lengths_arcs = ArcTable.of(problem.chains[problem.size :]) if len(problem.lengths) else None
        self._positive, self._negative = np.maximum(others, 0.0), np.minimum(others, 0.0)

    def tightened(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        """A smaller box with the same stationary points; None if there is none in it.

        Args:
            low: of the box, (n + m,), finite.
            high: of the box, (n + m,), finite.
        """
        n = self._problem.size
        for _ in range(MOST_ROUNDS):
            found = self._pass(low[:n], high[:n], self._most_tractions(low[n:], high[n:]))
            ends = None if found is None else self._with_lengths(found, low[n:], high[n:])
            if ends is None:
                return None
            shorter = (ends[1] - ends[0]) < (1.0 - PROGRESS) * (high - low)
            low, high = ends
            if not shorter.any():
                break
        return low, high

    def _most_tractions(self, low: Array, high: Array) -> Array:
        """The largest forces of laws of lengths on the unknowns, (n,)."""
        problem = self._problem
        lengths, result = problem.lengths, np.zeros(problem.size)
        if (arcs := self._lengths_arcs) is None:
            return result
        begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
        with np.errstate(invalid="ignore"):
            ends = [np.abs(arcs.tractions + arcs.slopes * (at - arcs.anchors)) for at in (begin, end)]
        most = np.where(begin <= end, np.maximum(*ends), 0.0).max(axis=1)
        result[lengths.members] = (most[:, None] * np.abs(lengths.factors))[lengths.there]
        return result

    def _with_lengths(self, box: tuple[Array, Array], low: Array, high: Array) -> tuple[Array, Array] | None:
        """A box of the unknowns and one of the lengths, each smaller by the other; None if they do not meet."""
        lengths = self._problem.lengths
        if not len(lengths):
            return box
        factors, there = np.abs(lengths.factors), lengths.there
        wide = 1.0 + WIDENED
        reach = np.divide((high * wide)[:, None], factors, out=np.zeros_like(factors), where=there)
        first, last = box[0].copy(), box[1].copy()
        opening = lengths.opens[:, None] & (np.arange(3) == 0)
        below = np.where(opening & (lengths.factors > 0.0), -np.inf, -reach)
        above = np.where(opening & (lengths.factors < 0.0), np.inf, reach)
        first[lengths.members] = np.maximum(first[lengths.members], below[there])
        last[lengths.members] = np.minimum(last[lengths.members], above[there])
        least, most = lengths.within(first, last)
        low, high = np.maximum(low, least / wide), np.minimum(high, most * wide)
        if np.any(first > last) or np.any(low > high):
            return None
        return np.concatenate([first, low]), np.concatenate([last, high])

    def _pass(self, low: Array, high: Array, others: Array) -> tuple[Array, Array] | None:
        force, diagonal, arcs = self._problem.force, self._diagonal, self._arcs
        least = force - self._positive @ high - self._negative @ low - others
        most = force - self._positive @ low - self._negative @ high + others
        slack = WIDENED * (np.abs(least) + np.abs(most) + np.abs(force))
        least, most = (least - slack)[:, None], (most + slack)[:, None]
        begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
        first, last = self._on_arcs(begin, end, least, most, arcs.meets(low, high))
        joint_low, joint_high = self._at_joints(low, high, least, most)
        first = np.minimum(first.min(axis=1), joint_low)
        last = np.maximum(last.max(axis=1), joint_high)
        first, last = self._at_bounds(low, high, least[:, 0], most[:, 0], first, last, diagonal)
        if np.any(first > last):
            return None
        wide = WIDENED * (np.abs(first) + np.abs(last) + (high - low))
        return np.maximum(low, first - wide), np.minimum(high, last + wide)

    def _on_arcs(self, begin: Array, end: Array, least: Array, most: Array, meets: Mask) -> tuple[Array, Array]:
        """The ends of what is left of each arc; (inf, -inf) of those that are lost."""
        arcs, d = self._arcs, self._diagonal[:, None]
        with np.errstate(invalid="ignore", divide="ignore"):
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
        """The first and the last joint in the box whose interval of tractions meets the forces."""
        arcs, d = self._arcs, self._diagonal[:, None]
        at = arcs.high[:, :-1]
        inside = (at >= low[:, None]) & (at <= high[:, None])
        if not self._joints_at_ends:
            inside &= ((at > low[:, None]) & (at < high[:, None])) | (low == high)[:, None]
        with np.errstate(invalid="ignore"):
            a, b = arcs.before[:, :-1] + d * at, arcs.after[:, 1:] + d * at
            meets = inside & (np.minimum(a, b) <= most) & (np.maximum(a, b) >= least)
        first = np.where(meets, at, np.inf).min(axis=1, initial=np.inf)
        return first, np.where(meets, at, -np.inf).max(axis=1, initial=-np.inf)

    def _at_bounds(
        self, low: Array, high: Array, least: Array, most: Array, first: Array, last: Array, diagonal: Array
    ) -> tuple[Array, Array]:
        """The ends of the range stay where a bound can push there."""
        problem, rows = self._problem, np.arange(len(low))
        arcs = self._arcs
        for at, bound, upper in ((low, problem.lower, False), (high, problem.upper, True)):
            k = arcs.at(at)
            pull = arcs.tractions[rows, k] + arcs.slopes[rows, k] * (at - arcs.anchors[rows, k]) + diagonal * at
            slack = WIDENED * (np.abs(pull) + np.abs(least) + np.abs(most))
            pushes = (most >= pull - slack) if upper else (least <= pull + slack)
            stays = (at == bound) & pushes
            first, last = np.where(stays, np.minimum(first, at), first), np.where(stays, np.maximum(last, at), last)
        return first, last
