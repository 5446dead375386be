"""Cells of laws whose tractions are polylines: those with one stationary point at most, or with a continuum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cholesky

from ..typing import Array, Integers
from . import length_kinds
from .arcs import ArcTable
from .boxes import Box
from .cell_parts import at_bounds
from .convex_programme import minimise
from .linear_points import is_singular, some_solution
from .point_list import StationaryPoint
from .relaxation import envelopes
from .scalar_problem import ScalarProblem


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What is known of a cell.

    Attributes:
        point: a stationary point in the cell; None where none is found.
        decided: whether there is no other one.
    """

    point: StationaryPoint | None = None
    decided: bool = True


OPEN = Verdict(decided=False)
"""What is known of a cell that is to be divided."""


class PolylineCells:
    """Cells of laws whose tractions are polylines.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem = problem

    def verdict(self, cell: Box) -> Verdict:
        """What is known of a cell.

        Args:
            cell: the cell.
        """
        arcs, problem = self._problem.arcs, self._problem
        fixed = cell.low == cell.high
        free = np.flatnonzero(~fixed)
        if not free.size:
            return self._done(cell.low)
        if np.any(arcs.drops(cell.low, cell.high) > 0.0):
            return OPEN
        slopes = arcs.least_slope(cell.low, cell.high)
        matrix = problem.stiffness[np.ix_(free, free)] + np.diag(slopes[free])
        if _positive(matrix, problem.thresholds.cells.regular):
            return self._done(self._minimum(cell, np.where(fixed, 0.0, -np.minimum(slopes, 0.0))))
        if np.any(arcs.meets(cell.low, cell.high)[free].sum(axis=1) > 1) or np.any(at_bounds(problem, cell)[free]):
            return OPEN
        return self._linear(cell, free, matrix)

    def point(self, x: Array, *, isolated: bool = True) -> StationaryPoint | None:
        """The stationary point at a place; None where there is none.

        Args:
            x: the place, (n,).
            isolated: False where it is one of a continuum.
        """
        problem = self._problem
        x = np.clip(x, problem.lower, problem.upper)
        if length_kinds.imbalance(problem, x) > problem.thresholds.points.accuracy:
            return None
        kind = length_kinds.kind_of(problem, x)
        return StationaryPoint(x=x, energy=problem.energy(x), kind=kind, isolated=isolated)

    def _done(self, x: Array, *, isolated: bool = True) -> Verdict:
        """Nothing is left of a cell but perhaps this point."""
        return Verdict(point=self.point(x, isolated=isolated))

    def _minimum(self, cell: Box, added: Array) -> Array:
        """The minimiser of a cell on which the energy is convex, the falls of its laws being less than S."""
        problem, chains = self._problem, ArcTable.of(envelopes(self._problem, cell.low, cell.high, added))
        programmes = problem.thresholds.programmes
        return minimise(problem.stiffness - np.diag(added), problem.force, chains, cell.x, programmes).x

    def _linear(self, cell: Box, free: Integers, matrix: Array) -> Verdict:
        """The solutions of a cell in which every law is on one arc."""
        problem, arcs, rows = self._problem, self._problem.arcs, np.arange(self._problem.size)
        k = np.argmax(arcs.meets(cell.low, cell.high), axis=1)
        offset = arcs.tractions[rows, k] - arcs.slopes[rows, k] * arcs.anchors[rows, k]
        held = np.setdiff1d(rows, free)
        right = problem.force[free] - offset[free] - problem.stiffness[np.ix_(free, held)] @ cell.low[held]
        x, low, high = cell.low.copy(), cell.low[free], cell.high[free]
        if not is_singular(matrix, problem.thresholds.cells.condition):
            x[free] = np.linalg.solve(matrix, right)
            near = problem.thresholds.points.same * (1.0 + np.abs(x[free]))
            inside = np.all((x[free] >= low - near) & (x[free] <= high + near))
            return self._done(x) if inside else Verdict()
        if (inner := some_solution(matrix, right, np.column_stack([low, high]))) is None:
            return Verdict()
        x[free] = inner
        return self._done(x, isolated=False)


def _positive(matrix: Array, regular: float) -> bool:
    """Whether a matrix is positive definite, its least pivot above a share of the largest."""
    try:
        pivots = np.diag(cholesky(matrix, lower=True))
    except LinAlgError:
        return False
    return bool(pivots.min() > regular * pivots.max())
