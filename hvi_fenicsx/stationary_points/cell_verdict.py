"""What is known of a cell after a kind of laws has been asked about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from ..typing import Array
from .balance_programme import Guide
from .boxes import Box
from .point_list import PointList, StationaryPoint


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What is known of a cell.

    Attributes:
        points: stationary points that were found, in the cell or near it.
        left: the part of the cell that may hold others; None if there is none.
        guide: where the laws themselves would have it divided; None where they do not tell.
        undecided: whether it is too small to be divided, and yet may hold a point.
    """

    points: Sequence[StationaryPoint] = ()
    left: Box | None = None
    guide: Guide | None = None
    undecided: bool = False


class Points(Protocol):
    """What is known of places: which are stationary points, and which of these are one."""

    def point(self, x: Array) -> StationaryPoint | None:
        """The stationary point at a place, or very near it; None where there is none.

        Args:
            x: the place, (n,).
        """

    def joined(self, x: Array, y: Array) -> bool:
        """Whether two points cannot be told apart, or are parts of one continuum: all between is in balance.

        Args:
            x: a stationary point, (n,).
            y: another one, (n,).
        """


class LawsOfCells(Points, Protocol):
    """Laws of some kind: what they allow in a cell, and at a point."""

    def verdict(self, cell: Box, known: PointList) -> Verdict:
        """What is known of a cell.

        Args:
            cell: the cell.
            known: points that were found before.
        """
