"""What a search for all stationary points asks of the cells of a problem."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from .boxes import Box
from .cell_verdict import Points
from .point_list import PointList, StationaryPoint


@dataclass(frozen=True, kw_only=True)
class Divided:
    """What became of a cell.

    Attributes:
        points: stationary points that were found, in the cell or near it.
        parts: what may hold others, the one to look at first last.
        undecided: cells too small to be divided that may hold a point.
    """

    points: Sequence[StationaryPoint] = ()
    parts: Sequence[Box] = ()
    undecided: Sequence[Box] = ()


class Cells(Points, Protocol):
    """The cells of a problem."""

    def first(self) -> Box | None:
        """A cell that holds all stationary points; None if there is none."""

    def divided(self, cell: Box, known: PointList, cut: Callable[[], bool]) -> Divided:
        """Test a cell, and divide what is left.

        Args:
            cell: the cell.
            known: points that were found before.
            cut: whether to be content with less of a proof.
        """
