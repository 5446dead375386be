"""A test that no point of a cell balances the forces: a linear programme, its verdict checked in exact terms.

The graph (x, t) of each law on its interval lies in the hull of its corners; where a bound can push, with a ray. If
multipliers y exist with y·(Sx + t) > y·f for all corners, no stationary point is in the cell. The programme only finds
y; that the inequality holds is then evaluated, with an allowance for rounding, so no tolerance of it matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from ..typing import Array, Integers
from .arcs import on_interval
from .scalar_problem import ScalarProblem


@dataclass(frozen=True, kw_only=True)
class _Corners:
    """Corners of all graphs in a cell, and the rays of bounds.

    Attributes:
        x: displacements, (m,).
        t: tractions, (m,).
        owner: unknowns, (m,).
        push: -1 where a lower bound pushes, 1 where an upper one does, (r,).
        pushed: unknowns, (r,).
    """

    x: Array
    t: Array
    owner: Integers
    push: Array
    pushed: Integers


class LinearTest:
    """The test for one problem.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem = problem

    def excludes(self, low: Array, high: Array) -> bool:
        """Whether no stationary point is in a cell.

        Args:
            low: of the cell, (n,), finite.
            high: of the cell, (n,), finite.
        """
        corners = self._corners(low, high)
        columns, right = self._columns(corners)
        n, m = self._problem.size, columns.shape[1]
        size = np.maximum(np.abs(columns[:n]).max(axis=1), np.abs(right[:n]))
        size = np.where(size > 0.0, size, 1.0)
        columns[:n] /= size[:, None]
        right[:n] /= size
        slack = np.vstack([np.eye(n), np.zeros((n, n))])
        cost = np.concatenate([np.zeros(m), np.ones(2 * n)])
        found = linprog(cost, A_eq=np.hstack([columns, slack, -slack]), b_eq=right, bounds=(0, None), method="highs")
        if found.status != 0 or found.fun <= 0.0:
            return False
        return self._least(-found.eqlin.marginals[:n] / size, corners) > 0.0

    def _least(self, y: Array, corners: _Corners) -> float:
        """The least of y·(Sx + t - f) over all corners and along all rays, less its rounding.

        Args:
            y: multipliers, (n,); those by which a ray would have no least are left out.
            corners: of the cell.
        """
        problem = self._problem
        wrong = corners.pushed[y[corners.pushed] * corners.push < 0.0]
        y = y.copy()
        y[wrong] = 0.0
        pull = problem.stiffness @ y
        values = pull[corners.owner] * corners.x + y[corners.owner] * corners.t
        least = np.full(problem.size, np.inf)
        np.minimum.at(least, corners.owner, values)
        sizes = (np.abs(problem.stiffness) @ np.abs(y))[corners.owner] * np.abs(corners.x)
        rounding = np.finfo(float).eps * problem.size * (sizes.sum() + np.abs(y) @ np.abs(problem.force))
        return float(least.sum() - y @ problem.force - rounding)

    def _corners(self, low: Array, high: Array) -> _Corners:
        problem = self._problem
        table = [(x, t, i) for i in range(problem.size) for x, t in self._graph(i, float(low[i]), float(high[i]))]
        x, t, owner = np.array(table).T
        below, above = np.flatnonzero(low <= problem.lower), np.flatnonzero(high >= problem.upper)
        return _Corners(
            x=x,
            t=t,
            owner=owner.astype(np.int64),
            push=np.concatenate([-np.ones(below.size), np.ones(above.size)]),
            pushed=np.concatenate([below, above]),
        )

    def _graph(self, i: int, low: float, high: float) -> set[tuple[float, float]]:
        """Corners (x, t) of the law's graph on an interval; at a joint alone all its tractions."""
        if low == high:
            return {(low, a.rate(low)) for a in self._problem.chains[i] if a.low <= low <= a.high}
        limits = self._problem.thresholds.cells
        arcs = on_interval(self._problem.chains[i], low, high)
        corners = {(x, a.rate(x)) for a in arcs for x in (a.low, a.high)}
        return corners if len(corners) <= limits.many_corners else _without_inner(corners, limits.hull_rounding)

    def _columns(self, corners: _Corners) -> tuple[Array, Array]:
        """Equations of the shares of corners and rays: forces in balance, shares of each unknown sum to 1."""
        problem, n, m = self._problem, self._problem.size, len(corners.x)
        columns = np.zeros((2 * n, m + len(corners.push)))
        columns[:n, :m] = problem.stiffness[:, corners.owner] * corners.x
        columns[corners.owner, np.arange(m)] += corners.t
        columns[corners.pushed, m + np.arange(len(corners.push))] = corners.push
        columns[n + corners.owner, np.arange(m)] = 1.0
        return columns, np.concatenate([problem.force, np.ones(n)])


def _without_inner(corners: set[tuple[float, float]], rounding: float) -> set[tuple[float, float]]:
    """The corners of the hull (Andrew 1979, Information Processing Letters 9); one that rounding leaves is no harm."""
    ordered = sorted(corners)
    upper = _lower_hull([(x, -t) for x, t in ordered], rounding)
    return {*_lower_hull(ordered, rounding), *((x, -t) for x, t in upper)}


def _lower_hull(ordered: list[tuple[float, float]], rounding: float) -> list[tuple[float, float]]:
    hull: list[tuple[float, float]] = []
    for x, t in ordered:
        while len(hull) > 1 and _is_above(hull[-1], hull[-2], (x, t), rounding):
            hull.pop()
        hull.append((x, t))
    return hull


def _is_above(
    middle: tuple[float, float], first: tuple[float, float], last: tuple[float, float], rounding: float
) -> bool:
    """Whether a point lies above the chord between two others by more than rounding."""
    x, t = middle[0] - first[0], middle[1] - first[1]
    dx, dt = last[0] - first[0], last[1] - first[1]
    return t * dx - dt * x > rounding * (abs(t * dx) + abs(dt * x))
