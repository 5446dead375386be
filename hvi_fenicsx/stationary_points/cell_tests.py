"""What tests leave of a cell."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..typing import Integers
from . import monotone_radius
from .balance_test import BalanceTest, Look
from .boxes import Box
from .elastic_radius import ElasticRadius
from .linear_test import LinearTest
from .relaxation import Relaxation
from .rigid_balance import RigidBalance
from .scalar_problem import ScalarProblem
from .settled import settled
from .tightening import ForceIntervals


class CellTests:
    """The tests of one problem.

    Args:
        problem: the problem.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self.problem, self._thresholds = problem, problem.thresholds.cells
        self.balance = RigidBalance(problem)
        self._forces = ForceIntervals(problem, joints_at_ends=False)
        self._elastic = ElasticRadius(problem, self.balance)
        self._linear, self._relaxation = LinearTest(problem), Relaxation(problem)
        self._weighed = BalanceTest(self._relaxation)

    @property
    def pivots(self) -> Integers:
        """Unknowns that fix the rigid motions."""
        return self.balance.pivots

    def tightened(self, cell: Box) -> Box | None:
        """The cell made smaller; None if no stationary point is in it.

        Args:
            cell: the cell.
        """
        for _ in range(self._thresholds.most_rounds):
            smaller = self.tightened_once(cell)
            if smaller is None:
                return None
            shrinks = np.any(smaller.high - smaller.low < self._thresholds.shorter * (cell.high - cell.low))
            cell = settled(self.problem, smaller)
            if not shrinks:
                break
        return cell

    def tightened_once(self, cell: Box) -> Box | None:
        """The cell made smaller by each test once; None if no stationary point is in it.

        Args:
            cell: the cell.
        """
        sides = self._forces.tightened(cell.low, cell.high)
        sides = None if sides is None else self.balance.tightened(*sides)
        if sides is None:
            return None
        smaller = monotone_radius.tightened(self._relaxation, replace(cell, low=sides[0], high=sides[1]))
        return None if np.any(smaller.low > smaller.high) else self._elastic.tightened(smaller)

    def weighed(self, cell: Box, cut: Callable[[], bool]) -> Look | None:
        """What the weighed balance leaves of a cell; None if no stationary point is in it.

        Args:
            cell: the cell.
            cut: whether to be content with less of a proof.
        """
        return self._weighed.look(cell, cut)

    def excludes(self, cell: Box) -> bool:
        """Whether a linear programme tells that no stationary point is in a cell.

        Args:
            cell: the cell.
        """
        return self._linear.excludes(cell.low, cell.high)
