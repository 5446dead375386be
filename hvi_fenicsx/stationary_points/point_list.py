"""Stationary points, and a list of them in which each is once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .stationarity import Kind


@dataclass(frozen=True, kw_only=True)
class StationaryPoint:
    """A point that satisfies the inequality.

    Attributes:
        x: (n,).
        energy: there.
        kind: minimiser, saddle or undecided.
        isolated: False where it is one of a continuum.
    """

    x: Array
    energy: float
    kind: Kind
    isolated: bool


class PointList:
    """Different points.

    Args:
        size: number n of unknowns.
        same: points nearer than this share of the displacements are one.

    Attributes:
        listed: the points, as they were added.
    """

    def __init__(self, size: int, same: float) -> None:
        self._same = same
        self.listed: list[StationaryPoint] = []
        self._places: Array = np.empty((0, size))

    def __len__(self) -> int:
        return len(self.listed)

    def __iter__(self) -> Iterator[StationaryPoint]:
        return iter(self.listed)

    def distances(self, x: Array) -> Array:
        """The largest differences from each point, in their order.

        Args:
            x: a point, (n,).
        """
        return np.asarray(np.abs(self._places[: len(self)] - x).max(axis=1, initial=0.0))

    def has(self, x: Array) -> bool:
        """Whether a point is in the list.

        Args:
            x: the point, (n,).
        """
        return bool(np.any(self.distances(x) < self._same * (1.0 + float(np.max(np.abs(x), initial=0.0)))))

    def add(self, point: StationaryPoint) -> None:
        """Put a point at the end.

        Args:
            point: a new one.
        """
        count = len(self)
        if count == len(self._places):
            self._places = np.concatenate([self._places, np.empty((count + 1, len(point.x)))])
        self._places[count] = point.x
        self.listed.append(point)
