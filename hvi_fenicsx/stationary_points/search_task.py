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
