"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where its laws tell that it has one
stationary point at most, and which (:mod:`.polyline_cells`). A drop is divided in three: before it, behind it, and on
it, where the traction may have any value between. Laws act on one component each, and their tractions are polylines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..typing import Array
from .balance_programme import BalanceTest, Look
from .boxes import Box, fresh_box
from .cells import PolylineCells, parts, settled
from .elastic_radius import ElasticRadius
from .relaxation import Relaxation
from .rigid_balance import RigidBalance
from .scalar_problem import ScalarProblem
from .stationarity import PointList, StationaryPoint
from .tightening import ForceIntervals


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
        self.points = PointList(self.problem.size, self.problem.thresholds.points.same)
        self._laws, self._balance = PolylineCells(self.problem), RigidBalance(self.problem)
        self._forces = ForceIntervals(self.problem, joints_at_ends=False)
        self._elastic = ElasticRadius(self.problem, self._balance)
        self._weighed = BalanceTest(Relaxation(self.problem))

    def start(self) -> None:
        """Begin with a cell that is far larger than the problem's displacements."""
        problem, far = self.problem, self.problem.far
        low, high = np.maximum(problem.lower, -far), np.minimum(problem.upper, far)
        cell = self._tightened(fresh_box(low, high, np.zeros(problem.size)))
        if cell is not None:
            self.waiting.append(cell)

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
        self._enter(self._laws.point(x))

    def _enter(self, point: StationaryPoint | None) -> None:
        if point is not None and not self.points.has(point.x):
            self.points.add(point)

    def _divide(self, cell: Box) -> None:
        """Test a cell, keep its point, and put the parts of what is left on the stack."""
        look = self._looked(cell)
        if look is None:
            return
        verdict = self._laws.verdict(look.cell)
        self._enter(verdict.point)
        if not verdict.decided:
            self.waiting += parts(self.problem, self._balance.pivots, look.cell, look.guide)

    def _looked(self, cell: Box) -> Look | None:
        """The cell made smaller, and where to divide it; None if no stationary point is in it."""
        look, limits = None, self.problem.thresholds.cells
        for _ in range(limits.most_looks):
            if (tight := self._tightened(cell)) is None:
                return None
            if (look := self._weighed.look(tight, self.cut)) is None:
                return None
            cell = look.cell
            if self.cut() or not np.any(cell.high - cell.low < limits.shorter_look * (tight.high - tight.low)):
                break
        return look

    def _tightened(self, cell: Box) -> Box | None:
        """The cell made smaller; None if no stationary point is in it."""
        limits = self.problem.thresholds.cells
        for _ in range(limits.most_rounds):
            smaller = self._tightened_once(cell)
            if smaller is None:
                return None
            shrinks = np.any(smaller.high - smaller.low < limits.shorter * (cell.high - cell.low))
            cell = settled(self.problem, smaller)
            if not shrinks:
                break
        return cell

    def _tightened_once(self, cell: Box) -> Box | None:
        sides = self._forces.tightened(cell.low, cell.high)
        sides = None if sides is None else self._balance.tightened(*sides)
        if sides is None:
            return None
        return self._elastic.tightened(replace(cell, low=sides[0], high=sides[1]))
