"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where its laws tell that it has one
stationary point at most, and which (:mod:`.polyline_cells`, :mod:`.curved_cells`). A drop is divided in three: before
it, behind it, and on it, where the traction may have any value between. Of curved laws the tests that make cells
smaller see polylines near the tractions, and allow for what these differ by.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..typing import Array
from . import monotone_radius
from .balance_test import BalanceTest, Look
from .boxes import Box, fresh_box
from .cell_parts import parts
from .cell_verdict import LawsOfCells
from .curved_cells import CurvedCells
from .curved_laws import CurvedLaws
from .elastic_radius import ElasticRadius
from .linear_test import LinearTest
from .point_list import PointList, StationaryPoint
from .polyline_cells import PolylineCells
from .relaxation import Relaxation
from .rigid_balance import RigidBalance
from .scalar_problem import ScalarProblem
from .settled import settled
from .tightening import ForceIntervals


@dataclass(kw_only=True)
class Enumeration:
    """A search for all stationary points.

    Attributes:
        problem: the problem; of curved laws that of the polylines near them.
        laws: the laws, where these are curved.
        cut: whether the test of a cell is to be cut short, since the search stops.
        points: found so far.
        cells: looked at so far.
        waiting: a stack of cells not yet decided.
        undecided: cells too small to be divided in which curved laws may have a point.
    """

    problem: ScalarProblem
    laws: CurvedLaws | None = None
    cut: Callable[[], bool] = lambda: False
    points: PointList = field(init=False)
    cells: int = 0
    waiting: list[Box] = field(default_factory=list)
    undecided: list[Box] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.laws is None and np.any(self.problem.force_error):
            raise ValueError("of polylines near curved laws the laws themselves are needed")
        self._forces = ForceIntervals(self.problem, joints_at_ends=False)
        self._balance = RigidBalance(self.problem, self.laws)
        self._elastic = ElasticRadius(self.problem, self._balance)
        self._thresholds = self.problem.thresholds.cells
        self.points = PointList(self.problem.size, self.problem.thresholds.points.same)
        self._cells: LawsOfCells = PolylineCells(self.problem) if self.laws is None else CurvedCells(self.laws)
        self._linear, self._relaxation = LinearTest(self.problem), Relaxation(self.problem)
        self._weighed = BalanceTest(self._relaxation)

    def start(self) -> None:
        """Begin with a cell that is far larger than the problem's displacements."""
        problem, far = self.problem, self.problem.far
        low, high = np.maximum(problem.lower, -far), np.minimum(problem.upper, far)
        cell = self._tightened(fresh_box(low, high, np.zeros(problem.size)))
        if cell is None:
            return
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
            look = self._looked(self.waiting.pop())
            if look is not None:
                self.waiting += self._parts(look)
            report(self)
        return True

    @property
    def open_cells(self) -> int:
        """The number of cells that may hold further points."""
        return len(self.undecided) + len(self.waiting)

    def _parts(self, look: Look) -> list[Box]:
        """The parts of what is left of a cell; points that are found on the way are kept."""
        verdict = self._cells.verdict(look.cell, self.points)
        for point in verdict.points:
            self._enter(point)
        if verdict.undecided:
            self.undecided.append(look.cell)
        left = verdict.left
        if left is None or self._linear.excludes(left.low, left.high):
            return []
        guides = [guide for guide in (look.guide, verdict.guide) if guide is not None]
        return parts(self.problem, self._balance.pivots, left, guides)

    def _looked(self, cell: Box) -> Look | None:
        """The cell made smaller, and where to divide it; None if no stationary point is in it."""
        look = None
        for _ in range(self._thresholds.most_looks):
            if (tight := self._tightened(cell)) is None or (look := self._weighed.look(tight, self.cut)) is None:
                return None
            cell, shorter = look.cell, self._thresholds.shorter_look
            if self.cut() or not np.any(cell.high - cell.low < shorter * (tight.high - tight.low)):
                break
        return look

    def _tightened(self, cell: Box) -> Box | None:
        """The cell made smaller; None if no stationary point is in it."""
        for _ in range(self._thresholds.most_rounds):
            smaller = self._tightened_once(cell)
            if smaller is None:
                return None
            shrinks = np.any(smaller.high - smaller.low < self._thresholds.shorter * (cell.high - cell.low))
            cell = settled(self.problem, smaller)
            if not shrinks:
                break
        return cell

    def _tightened_once(self, cell: Box) -> Box | None:
        sides = self._forces.tightened(cell.low, cell.high)
        sides = None if sides is None else self._balance.tightened(*sides)
        if sides is None:
            return None
        smaller = monotone_radius.tightened(self._relaxation, replace(cell, low=sides[0], high=sides[1]))
        return None if np.any(smaller.low > smaller.high) else self._elastic.tightened(smaller)

    def enter(self, x: Array) -> None:
        """Keep the stationary point at a place, or very near it, if there is one and it is new.

        Args:
            x: the place, (n,).
        """
        self._enter(self._cells.point(x))

    def _enter(self, point: StationaryPoint | None) -> None:
        if point is None or self.points.has(point.x):
            return
        k = self.points.nearest(point.x)
        if k is None or not self._cells.joined(self.points.listed[k].x, point.x):
            self.points.add(point)
        elif not point.isolated:
            self.points.listed[k] = replace(self.points.listed[k], isolated=False)
