"""What is asked of a search, and what it found: how much of it is proven, and what is needed to go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..typing import Array
from .point_list import StationaryPoint
from .progress_words import Unit

Saved = Mapping[str, Array]
"""What is left of an unfinished search: arrays, by name."""
Keep = Callable[[Callable[[], Saved]], None]
"""Is given, after each box, what makes the state to go on from."""


@dataclass(frozen=True, kw_only=True)
class Start:
    """What an earlier search of nearly the same problem knows of its lowest point.

    Attributes:
        x: a point of low energy, (n,).
        energy: there.
        low: of a box that holds all points of lower energy, (n + m,).
        high: of that box, (n + m,).
        bound: no point has a lower energy of the laws themselves.
    """

    x: Array
    energy: float
    low: Array
    high: Array
    bound: float

    @property
    def reach(self) -> Array:
        """The largest displacement of each unknown in the box, (n,)."""
        return np.asarray(np.max(np.abs([self.low, self.high]), axis=0)[: len(self.x)])


@dataclass(frozen=True, kw_only=True)
class Wanted:
    """What is asked for.

    Attributes:
        lowest: the lowest energy with a proof; else all equilibria.
        gap: relative gap that the proof of the lowest may leave.
        bounded: whether the energy is known to be bounded from below.
        has_potential: whether all laws are derivatives of an energy.
        no_lowest: why there is no lowest energy; empty where there may be one.
        start: where the lowest is, as far as that is known.
        known: points near which equilibria are known to be, (n,) each.
        energies: the unit of energies in reports.
        exact: makes a point near an equilibrium exact; None where there is none near it.
    """

    lowest: bool = False
    gap: float = 1e-8
    bounded: bool = True
    has_potential: bool = True
    no_lowest: str = ""
    start: Start | None = None
    known: tuple[Array, ...] = ()
    energies: Unit = field(default_factory=Unit)
    exact: Callable[[Array], StationaryPoint | None] | None = None


def forget(state: Callable[[], Saved]) -> None:
    """Keep nothing.

    Args:
        state: makes what could be kept.
    """


@dataclass(frozen=True, kw_only=True)
class Found:
    """What a search found.

    Attributes:
        points: by energy.
        complete: whether these are all stationary points.
        lower_bound: no point has a lower energy; None where none is known.
        proven: whether what was asked for is proven.
        nodes: boxes that were bounded or tested.
        reason: how it ended, for people.
        left: what is needed to go on; empty if there is nothing left.
    """

    points: tuple[StationaryPoint, ...]
    complete: bool
    lower_bound: float | None
    proven: bool
    nodes: int
    reason: str
    left: Saved = field(default_factory=dict)

    @property
    def gap(self) -> float | None:
        """Lowest energy found minus lower bound, relative to that energy; None where there is no bound."""
        if self.lower_bound is None or not self.points:
            return None
        lowest = self.points[0].energy
        return max(lowest - self.lower_bound, 0.0) / (abs(lowest) or 1.0)
