"""A search to be made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from .found import Keep, Saved, Wanted
from .scalar_problem import ScalarProblem


@dataclass(frozen=True, kw_only=True)
class Task:
    """A search to be made: the arguments of a search."""

    problem: ScalarProblem
    wanted: Wanted
    stop: Callable[[], bool]
    report: Callable[[str], None]
    saved: Saved | None
    keep: Keep

    @property
    def most_boxes(self) -> int:
        """Boxes that are bounded for the gap where what was asked for is not proven."""
        return self.problem.thresholds.lowest.most_boxes

    @property
    def first_cells(self) -> int:
        """Cells for all points that are looked at first: of many vectors each takes long and tells little."""
        few = self.problem.thresholds.systematic.vectors
        return max(self.most_boxes * few // max(len(self.problem.lengths), few), 1)
