"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where its laws tell that it has one
stationary point at most, and which (:mod:`.cells`). A drop is divided in three: before it, behind it, and on
it, where the traction may have any value between. Laws act on one component each, and their tractions are polylines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..typing import Array
from .balance_programme import BalanceTest, Look
from .cells import PolylineCells, parts, settled
from .relaxation import Relaxation
from .rigid_balance import RigidBalance
from .scalar_problem import Box, ScalarProblem
from .stationarity import PointList
from .thresholds import LIMITS
from .tightening import ForceIntervals, clipped_again, shorter


@dataclass(kw_only=True)
class Enumeration:
    """A search for all stationary points.

    Attributes:
        problem: the problem.
        cut: whether the test of a cell is to be cut short, since the search stops.
        points: found so far.
        cells: looked at so far.
        waiting: a stack of cells not yet decided.
    """

    problem: ScalarProblem
    cut: Callable[[], bool] = lambda: False
    points: PointList = field(init=False)
    cells: int = 0
    waiting: list[Box] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.points = PointList(LIMITS.same)
        self._laws, self._balance = PolylineCells(self.problem), RigidBalance(self.problem)
        self._forces, self._weighed = ForceIntervals(self.problem), BalanceTest(Relaxation(self.problem))

    def start(self) -> None:
        """Begin with a cell that is far larger than the problem's displacements."""
        problem, far = self.problem, self.problem.far
        low, high = np.maximum(problem.lower, -far), np.minimum(problem.upper, far)
        self.waiting.append(Box.around(low, high, np.zeros(problem.size)))

    def run(self, stop: Callable[[], bool], report: Callable[[Enumeration], None]) -> bool:
        """Divide cells until none is left; whether that is so.

        Args:
            stop: asked before each cell.
            report: told after each cell.
        """
        while self.waiting:
            if stop():
                return False
            self.cells += 1
            self._divide(self.waiting.pop())
            report(self)
        return True

    def enter(self, x: Array) -> None:
        """Keep the stationary point at a place, if there is one and it is new.

        Args:
            x: the place, (n,).
        """
        self.points.add(self._laws.point(x))

    def _divide(self, cell: Box) -> None:
        """Test a cell, keep its point, and put the parts of what is left on the stack."""
        look = self._looked(cell)
        if look is None:
            return
        verdict = self._laws.verdict(look.cell)
        self.points.add(verdict.point)
        if not verdict.decided:
            self.waiting += parts(self.problem, self._balance.pivots, look.cell, look.guide)

    def _looked(self, cell: Box) -> Look | None:
        """The cell made smaller, and where to divide it; None if no stationary point is in it."""
        look = Look(cell=cell, guide=None)
        for _ in range(LIMITS.most_rounds):
            if (tight := self._tightened(look.cell)) is None:
                return None
            if (found := self._weighed.look(tight, self.cut)) is None:
                return None
            look = found
            if self.cut() or not shorter(tight.low, tight.high, look.cell.low, look.cell.high).any():
                break
        return look

    def _tightened(self, cell: Box) -> Box | None:
        """The cell made smaller by balances of forces; None if no stationary point is in it."""
        ends = clipped_again(self._balanced, cell.low, cell.high)
        return None if ends is None else settled(self.problem, Box.around(*ends, cell.x))

    def _balanced(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        ends = self._forces.tightened(low, high)
        return None if ends is None else self._balance.tightened(*ends)
