"""Cells of problems whose laws act on one component each: an interval of each unknown, or one joint of its law."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..typing import Array
from .balance_test import Look
from .boxes import Box, fresh_box
from .cell_parts import parts
from .cell_tests import CellTests
from .cell_verdict import LawsOfCells, Verdict
from .curved_cells import CurvedCells
from .curved_laws import CurvedLaws
from .divided import Divided
from .point_list import PointList, StationaryPoint
from .polyline_cells import PolylineCells
from .scalar_problem import ScalarProblem


class ComponentCells:
    """The cells of one problem.

    Args:
        problem: the problem; of curved laws that of the polylines near them.
        laws: the laws, where these are curved.
    """

    def __init__(self, problem: ScalarProblem, laws: CurvedLaws | None) -> None:
        if laws is None and np.any(problem.force_error):
            raise ValueError("of polylines near curved laws the laws themselves are needed")
        self._problem, self._tests = problem, CellTests(problem, laws)
        self._laws: LawsOfCells = PolylineCells(problem) if laws is None else CurvedCells(laws)

    def first(self) -> Box | None:
        """A cell that is far larger than the problem's displacements; None if no stationary point is in it."""
        problem, far = self._problem, self._problem.far
        low, high = np.maximum(problem.lower, -far), np.minimum(problem.upper, far)
        return self._tests.tightened(fresh_box(low, high, np.zeros(problem.size)))

    def divided(self, cell: Box, known: PointList, cut: Callable[[], bool]) -> Divided:
        """Test a cell, and divide what is left.

        Args:
            cell: the cell.
            known: points that were found before.
            cut: whether to be content with less of a proof.
        """
        look = self._looked(cell, cut)
        if look is None:
            return Divided()
        verdict = self._laws.verdict(look.cell, known)
        undecided = [look.cell] if verdict.undecided else []
        return Divided(points=verdict.points, parts=self._parts(look, verdict), undecided=undecided)

    def point(self, x: Array) -> StationaryPoint | None:
        """The stationary point at a place, or very near it; None where there is none.

        Args:
            x: the place, (n,).
        """
        return self._laws.point(x)

    def joined(self, x: Array, y: Array) -> bool:
        """Whether two points cannot be told apart, or are parts of one continuum.

        Args:
            x: a stationary point, (n,).
            y: another one, (n,).
        """
        return self._laws.joined(x, y)

    def _parts(self, look: Look, verdict: Verdict) -> list[Box]:
        left = verdict.left
        if left is None or self._tests.excludes(left):
            return []
        guides = [guide for guide in (look.guide, verdict.guide) if guide is not None]
        return parts(self._problem, self._tests.pivots, left, guides)

    def _looked(self, cell: Box, cut: Callable[[], bool]) -> Look | None:
        """The cell made smaller, and where to divide it; None if no stationary point is in it."""
        look, limits = None, self._problem.thresholds.cells
        for _ in range(limits.most_looks):
            if (tight := self._tests.tightened(cell)) is None or (look := self._tests.weighed(tight, cut)) is None:
                return None
            cell = look.cell
            if cut() or not np.any(cell.high - cell.low < limits.shorter_look * (tight.high - tight.low)):
                break
        return look
