"""A search to be made, and how boxes are kept."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..typing import Array
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


def stacked(boxes: list[tuple[Array, Array, Array]]) -> dict[str, Array]:
    """Boxes as arrays by name, to be saved.

    Args:
        boxes: low, high and weights of each.
    """
    return {name: np.array([box[k] for box in boxes]) for k, name in enumerate(("low", "high", "weights"))}
