"""Smaller cells by strong monotonicity, where a rigid motion is free: how far elastic parts are from those of a point.

With y any point within the bounds, τ = f - Sy, and x a stationary point with forces t, the difference has
(x - y)ᵀS(x - y) = -(x - y)·(t - τ). A rigid motion r that moves no unknown with a bound has r·t = r·f = r·τ. So x - y
may be taken less such a motion: d = x - y - r c with c = (x - y)_p is elastic, and laws that can bear little leave it
little energy, however far x may have travelled. The tests that do without r·t = r·f know nothing there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..typing import Array
from .boxes import Box, clipped
from .rigid_balance import RigidBalance, product
from .scalar_problem import ScalarProblem

EPSILON = float(np.finfo(float).eps)


class ElasticRadius:
    """The test for one problem.

    Args:
        problem: the problem.
        balance: its rigid motions and elasticity.
    """

    def __init__(self, problem: ScalarProblem, balance: RigidBalance) -> None:
        self._problem, self._balance = problem, balance
        bounded = np.isfinite(problem.lower) | np.isfinite(problem.upper)
        free = ~np.any(balance.motions[bounded], axis=0)
        self._motions, self._pivots = balance.motions[:, free], balance.pivots[free]
        self._moved = np.any(self._motions, axis=1)
        self._alone = self._moved & ~np.any(balance.motions[:, ~free], axis=1)
        self._known = bool(balance.exact and free.any())

    def tightened(self, cell: Box) -> Box | None:
        """A smaller cell with the same stationary points; None if there is none in it.

        Args:
            cell: the cell; its x, or what is nearest to it there, is the point y.
        """
        if not self._known:
            return cell
        cell = replace(cell, x=clipped(cell.x, cell.low, cell.high))
        balance = self._balance
        if (forces := balance.forces(cell.low, cell.high)) is None:
            return None
        parts = self._near(cell, forces, *balance.elastic_parts(cell.low, cell.high, forces))
        ends = None if parts is None else balance.moved(cell.low, cell.high, *parts)
        return None if ends is None else replace(cell, low=ends[0], high=ends[1], x=clipped(cell.x, *ends))

    def _near(self, cell: Box, forces: tuple[Array, Array], first: Array, last: Array) -> tuple[Array, Array] | None:
        """Smaller intervals of the elastic parts; None if one is empty."""
        limits, balance, y = self._problem.thresholds.cells, self._balance, cell.x
        own = y - balance.motions @ y[balance.pivots]
        difference = _Difference(self._problem, cell, forces)
        low, high = product(self._motions, *(end[self._pivots] - y[self._pivots] for end in (cell.low, cell.high)))
        low, high = cell.low - y - high, cell.high - y - low
        for _ in range(limits.force_passes):
            low = np.where(self._alone, np.maximum(low, first - own), low)
            high = np.where(self._alone, np.minimum(high, last - own), high)
            energy = difference.energy(low, high, self._moved)
            if energy < 0.0 or np.any(first > last):
                return None
            reach = np.sqrt(balance.softness * energy) * (1.0 + limits.widened_radius)
            begin, end = np.maximum(first, own - reach), np.minimum(last, own + reach)
            shrinks = np.any(end - begin < limits.shorter * (last - first))
            first, last = begin, end
            if not shrinks:
                break
        return None if np.any(first > last) else (first, last)


class _Difference:
    """The forces of stationary points in a cell less those of the point y.

    Args:
        problem: the problem.
        cell: the cell, with y.
        forces: what laws and bounds bear there.
    """

    def __init__(self, problem: ScalarProblem, cell: Box, forces: tuple[Array, Array]) -> None:
        y, n = cell.x, problem.size
        held = problem.force - problem.stiffness @ y
        self._least, self._most = forces[0] - held, forces[1] - held
        self._products = least_products(problem, cell, y, np.zeros(n))
        sizes = sum(np.where(np.isfinite(part), np.abs(part), 0.0) for part in forces)
        sizes = sizes + np.abs(problem.force) + np.abs(problem.stiffness) @ np.abs(y)
        self._rounding = problem.thresholds.cells.roundings * n * EPSILON * sizes

    def energy(self, low: Array, high: Array, moved: Array) -> float:
        """The most that dᵀSd can be; of unknowns that no motion moves, law and displacement are taken together.

        Args:
            low: of d, (n,).
            high: of d, (n,).
            moved: the other unknowns, (n,).
        """
        ends = [side[moved] * force[moved] for side in (low, high) for force in (self._least, self._most)]
        products = self._products.copy()
        products[moved] = np.min(ends, axis=0)
        return float(self._rounding @ np.maximum(np.abs(low), np.abs(high)) - products.sum())


def least_products(problem: ScalarProblem, box: Box, y: Array, added: Array) -> Array:
    """The least (x - y)(t - τ) + d (x - y)² on the graph of each law in the box, (n,).

    What a bound bears adds nothing negative, since y is within the bounds.

    Args:
        problem: the problem.
        box: the box; where it is a point, y is there.
        y: a point in it, (n,).
        added: d, (n,).
    """
    arcs, at, d = problem.arcs, y[:, None], added[:, None]
    tau = (problem.force - problem.stiffness @ y)[:, None]
    low, high = np.maximum(arcs.low, box.low[:, None]), np.minimum(arcs.high, box.high[:, None])
    curve = arcs.slopes + d
    with np.errstate(invalid="ignore", divide="ignore"):
        start = arcs.tractions + arcs.slopes * (at - arcs.anchors) - tau
        middle = np.clip(np.where(curve > 0.0, at - 0.5 * start / curve, low), low, high)
        values = [(x - at) * (start + curve * (x - at)) for x in (low, high, middle)]
    least = np.where(arcs.meets(box.low, box.high), np.minimum(np.minimum(values[0], values[1]), values[2]), np.inf)
    return np.asarray(np.where(box.low == box.high, 0.0, least.min(axis=1)))
