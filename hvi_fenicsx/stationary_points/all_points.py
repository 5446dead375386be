"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where its laws tell that it has one
stationary point at most, and which (:mod:`.polyline_cells`, :mod:`.curved_cells`, :mod:`.smooth_proofs`). A drop is
divided in three: before it, behind it, and on it, where the traction may have any value between. Of curved laws the
tests that make cells smaller see polylines near the tractions, and allow for what these differ by. Where laws act on
lengths, cells have intervals of these, too (:mod:`.length_cells`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from ..typing import Array
from .boxes import Box
from .component_cells import ComponentCells
from .curved_laws import CurvedLaws
from .divided import Cells
from .length_cells import LengthCells
from .point_list import PointList, StationaryPoint
from .scalar_problem import ScalarProblem


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
        undecided: cells too small to be divided that may have a point.
    """

    problem: ScalarProblem
    laws: CurvedLaws | None = None
    cut: Callable[[], bool] = lambda: False
    points: PointList = field(init=False)
    cells: int = 0
    waiting: list[Box] = field(default_factory=list)
    undecided: list[Box] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.points = PointList(self.problem.size, self.problem.thresholds.points.same)
        self._cells: Cells = (
            LengthCells(self.problem) if len(self.problem.lengths) else ComponentCells(self.problem, self.laws)
        )

    def start(self) -> None:
        """Begin with a cell that is far larger than the problem's displacements."""
        cell = self._cells.first()
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
            found = self._cells.divided(self.waiting.pop(), self.points, self.cut)
            for point in found.points:
                self._enter(point)
            self.undecided += found.undecided
            self.waiting += found.parts
            report(self)
        return True

    @property
    def open_cells(self) -> int:
        """The number of cells that may hold further points."""
        return len(self.undecided) + len(self.waiting)

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
