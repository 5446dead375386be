"""Smaller boxes that hold the same equilibria: intervals of the forces, unknown by unknown."""

from __future__ import annotations

import numpy as np

from ..typing import Array
from .arcs import ArcTable
from .graph_clip import GraphClip, clipped_again
from .scalar_problem import ScalarProblem


class ForceIntervals:
    """What the balance of forces leaves of a box: Sᵢᵢxᵢ + ∂φᵢ(xᵢ) meets fᵢ - Σⱼ Sᵢⱼxⱼ, an interval.

    Args:
        problem: the problem.
        joints_at_ends: whether a joint at the end of an interval counts with all its tractions; if not, only where the
            interval is that joint alone.
    """

    def __init__(self, problem: ScalarProblem, *, joints_at_ends: bool = True) -> None:
        self._problem, diagonal = problem, np.diag(problem.stiffness).copy()
        self._graphs = GraphClip(problem, diagonal, joints_at_ends=joints_at_ends)
        others = problem.stiffness - np.diag(diagonal)
        self._lengths_arcs = ArcTable.of(problem.chains[problem.size :]) if len(problem.lengths) else None
        self._positive, self._negative = np.maximum(others, 0.0), np.minimum(others, 0.0)

    def tightened(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        """A smaller box with the same stationary points; None if there is none in it.

        Args:
            low: of the box, (n + m,), finite.
            high: of the box, (n + m,), finite.
        """
        limits = self._problem.thresholds.cells
        return clipped_again(self._once, low, high, most_rounds=limits.force_passes, progress=limits.force_progress)

    def _once(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        n = self._problem.size
        found = self._pass(low[:n], high[:n], self._most_tractions(low[n:], high[n:]))
        return None if found is None else self._with_lengths(found, low[n:], high[n:])

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
        wide = 1.0 + self._problem.thresholds.cells.widened
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
        force = self._problem.force
        least = force - self._positive @ high - self._negative @ low - others
        most = force - self._positive @ low - self._negative @ high + others
        widened = self._problem.thresholds.cells.widened
        slack = widened * (np.abs(least) + np.abs(most) + np.abs(force))
        return self._graphs.clipped(low, high, least - slack, most + slack)
