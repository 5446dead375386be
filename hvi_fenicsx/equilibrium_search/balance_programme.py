"""The programme that looks for the weights of a cell, and where its solution is far from the graphs of the laws.

Each law's point (xᵢ, tᵢ) is replaced by a mean over a few points of its graph, and bounds bear what they may. The least
of xᵀMx - f·x + Σ (dᵢ xᵢ² + xᵢ tᵢ) over all such means in balance is zero at stationary points; the duals of the balance
are weights that prove as much of the cell as can be proven in this way. What is missing in the balance has a price.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers
from .interior_point import Iterate, Programme, iterates
from .relaxation import Relaxation
from .scalar_problem import Box, ScalarProblem
from .thresholds import LIMITS
from .weighed_balance import Graphs, Split, weighed


@dataclass(frozen=True, kw_only=True)
class Guide:
    """Where a mean is far from its graph, as an energy.

    Attributes:
        x: the means, (n,).
        law: of each law, (n,).
        bound: of each bound that pushes, although the mean has left it, (n,).
    """

    x: Array
    law: Array
    bound: Array


@dataclass(frozen=True, kw_only=True)
class _Points:
    """Points of the graphs: unknown, displacement and traction, (m,) each."""

    owner: Integers
    x: Array
    t: Array


class BalanceProgramme:
    """The programme of one cell.

    Args:
        problem: the problem.
        split: M and D.
        low: of the cell, (n,), finite.
        high: of the cell, (n,), finite.
    """

    def __init__(self, problem: ScalarProblem, split: Split, low: Array, high: Array) -> None:
        self._problem, self._split, self._low, self._high = problem, split, low, high
        self._points = _points(Graphs.of(problem, low, high), split.diagonal)
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        below, above = np.flatnonzero(low <= problem.lower), np.flatnonzero(high >= problem.upper)
        self._pushed = np.concatenate([below, above])
        self._push = np.concatenate([-np.ones(below.size), np.ones(above.size)])
        self._bounds = np.concatenate([problem.lower[below], problem.upper[above]])
        self._force_scale, self._unit = self._scales()
        self._programme = self._made()

    def _scales(self) -> tuple[Array, float]:
        """The scale of each force, and that of the energy."""
        n, points = self._problem.size, self._points
        most, least = np.full(n, -np.inf), np.full(n, np.inf)
        np.maximum.at(most, points.owner, points.t)
        np.minimum.at(least, points.owner, points.t)
        forces = np.maximum(most - least, np.abs(self._problem.stiffness) @ self._half)
        forces = np.maximum(forces, LIMITS.enough * float(forces.max()) + 1e-300)
        largest = np.maximum(np.abs(most), np.abs(least)) + np.abs(self._problem.force)
        return forces, float(largest @ self._half) + 1e-300

    def _made(self) -> Programme:
        problem, n, points, scale, unit = self._problem, self._problem.size, self._points, self._force_scale, self._unit
        matrix, middle, half, owner = self._split.matrix, self._middle, self._half, self._points.owner
        away = points.x - middle[owner]
        along = np.divide(away, half[owner], out=np.zeros_like(away), where=half[owner] > 0.0)
        pull = 2.0 * (matrix @ middle) - problem.force
        cost = self._split.diagonal[owner] * points.x**2 + points.x * points.t + pull[owner] * away
        price = scale * float(np.max(np.abs([self._low, self._high]))) / (LIMITS.enough * unit)
        pushing = self._push * self._bounds * scale[self._pushed] / unit
        spare, each = np.zeros(len(self._push) + 2 * n), np.arange(n)
        ones = np.ones(n)
        return Programme(
            matrix=problem.stiffness * half / scale[:, None],
            curvature=np.asarray(2.0 * (matrix * half) * half[:, None] / unit),
            force=(problem.force - problem.stiffness @ middle) / scale,
            owner=np.concatenate([owner, self._pushed, each, each]),
            factors=np.stack(
                [
                    np.concatenate([points.t / scale[owner], self._push, ones, -ones]),
                    np.concatenate([-along, spare]),
                    np.concatenate([np.ones(len(owner)), spare]),
                ]
            ),
            cost=np.concatenate([cost / unit, pushing, price, price]),
            start=np.concatenate([1.0 / np.bincount(owner, minlength=n)[owner], np.ones(len(spare))]),
        )

    def iterates(self) -> Iterator[Iterate]:
        """The steps of the method."""
        return iterates(self._programme, LIMITS.most_steps, LIMITS.zero, LIMITS.nearly)

    def weights(self, here: Iterate) -> tuple[Array, Array]:
        """The weights and the point of an iterate, (n,) each.

        Args:
            here: the iterate.
        """
        return -here.duals[0] * self._unit / self._force_scale, self._middle + self._half * here.x

    def guide(self, here: Iterate) -> Guide:
        """Where an iterate is far from the graphs.

        Args:
            here: the iterate.
        """
        n, points, d, free = self._problem.size, self._points, self._split.diagonal, self._low < self._high
        shares, pushes = np.split(here.shares[: len(points.x) + len(self._push)], [len(points.x)])
        total = np.maximum(np.bincount(points.owner, shares, n), 1e-300)
        x, t, mean = (
            np.bincount(points.owner, shares * what, n) / total
            for what in (points.x, points.t, points.x * points.t + d[points.owner] * points.x**2)
        )
        x = np.clip(x, self._low, self._high)
        bound = np.zeros(n)
        forces = pushes * self._force_scale[self._pushed]
        np.add.at(bound, self._pushed, forces * np.abs(x[self._pushed] - self._bounds))
        law, size = x * t + d * x * x - mean, np.abs(x * t) + np.abs(d) * x * x
        far = free & (law > LIMITS.same * size)
        return Guide(x=x, law=np.where(far, law, 0.0), bound=np.where(free, bound, 0.0))


def _points(graphs: Graphs, diagonal: Array) -> _Points:
    """The ends of arcs, and some points between them where h is convex."""
    owner, k = np.nonzero(graphs.meets)
    begin, end = graphs.begin[owner, k], graphs.end[owner, k]
    inner = np.flatnonzero((diagonal[owner] + graphs.slope[owner, k] > 0.0) & (end > begin))
    quarters = (0.25, 0.5, 0.75)
    which = [np.arange(len(owner))] * 2 + [inner] * len(quarters)
    x = np.concatenate([begin, end, *(begin[inner] + share * (end - begin)[inner] for share in quarters)])
    each = np.concatenate(which)
    owner, k = owner[each], k[each]
    return _Points(owner=owner, x=x, t=graphs.offset[owner, k] + graphs.slope[owner, k] * x)


@dataclass(frozen=True, kw_only=True)
class Look:
    """What a test leaves of a cell.

    Attributes:
        cell: the cell, made smaller.
        guide: where it is to be divided; None if the programme failed.
    """

    cell: Box
    guide: Guide | None


class BalanceTest:
    """The test for one problem.

    Args:
        relaxation: of the problem.
    """

    def __init__(self, relaxation: Relaxation) -> None:
        self._relaxation, self._problem = relaxation, relaxation.problem

    def look(self, cell: Box, cut: Callable[[], bool] = lambda: False) -> Look | None:
        """What is left of a cell; None if no stationary point is in it.

        Args:
            cell: the cell.
            cut: whether to be content with less of a proof, asked at each step of the programme.
        """
        split = Split.of(self._problem, self._relaxation.diagonal(cell.low, cell.high))
        if not np.isfinite(split.short):
            return Look(cell=cell, guide=None)
        programme = BalanceProgramme(self._problem, split, cell.low, cell.high)
        best, last = None, None
        for step, last in enumerate(programme.iterates()):
            if cut():
                break
            if step % 3 == 0 and 4 * step >= LIMITS.most_steps:
                proof = weighed(self._problem, split, (cell.low, cell.high), *programme.weights(last))
                if proof.excludes:
                    return None
                if best is not None and not proof.total > best.total + LIMITS.enough * abs(best.total):
                    break
                if np.isfinite(proof.total):
                    best = proof
        guide = None if last is None else programme.guide(last)
        if best is None:
            return Look(cell=cell, guide=guide)
        smaller = best.smaller(cell.low, cell.high)
        return None if smaller is None else Look(cell=Box.around(*smaller, cell.x), guide=guide)
