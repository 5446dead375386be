"""What is asked of a search, and what it found: how much of it is proven, and what is needed to go on."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from ..typing import Array
from .enumeration import Enumeration
from .lowest import Progress
from .stationarity import StationaryPoint

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
    """

    x: Array
    energy: float
    low: Array
    high: Array

    @property
    def reach(self) -> Array:
        """The largest displacement of each unknown in the box, (n,)."""
        return np.asarray(np.max(np.abs([self.low, self.high]), axis=0)[: len(self.x)])


@dataclass(frozen=True, kw_only=True)
class Unit:
    """A unit of energy.

    Attributes:
        size: in J or J/m.
        name: J or J/m; empty where there is none.
    """

    size: float = 1.0
    name: str = ""


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


LEAST_DONE = 0.01
"""Share of a search that must be done before a time is told."""


@dataclass(frozen=True)
class Clock:
    """The time since a search began.

    Attributes:
        start: seconds.
    """

    start: float = field(default_factory=time.monotonic)

    def to_go(self, share: float) -> str:
        """About how long it will take; empty where too little is done.

        Args:
            share: of the search that is open.
        """
        done = 1.0 - share
        if done < LEAST_DONE:
            return ""
        return f", about {(time.monotonic() - self.start) * share / done:.0f} s to go"


def counted(count: int, one: str, several: str) -> str:
    """A number with the words for what is counted.

    Args:
        count: the number.
        one: words for one.
        several: words for another number.
    """
    return f"{count} {one if count == 1 else several}"


def lowest_in_words(now: Progress, energies: Unit, clock: Clock) -> str:
    """How far a search for the lowest energy is.

    Args:
        now: what is known.
        energies: the unit of energies.
        clock: since the search began.
    """
    low, high = (f"{bound * energies.size:.8g}" for bound in (now.lower, now.upper))
    ends = f"between {low} and {high} {energies.name}".rstrip()
    boxes = counted(now.boxes, "box", "boxes")
    return f"lowest: {ends}, gap {now.gap:.1e}, {boxes}, {now.waiting} open{clock.to_go(now.share)}"


def certified_in_words(done: int, count: int, clock: Clock) -> str:
    """How many of the equilibria found are certified, and written where they are written.

    Args:
        done: so many.
        count: of so many.
        clock: since the first one.
    """
    return f"certified: {done} of {count} equilibria{clock.to_go(1.0 - done / count)}"


def all_in_words(search: Enumeration, clock: Clock) -> str:
    """How far a search for all equilibria is.

    Args:
        search: the search.
        clock: since it began.
    """
    share = sum(cell.share for cell in search.waiting)
    found = f"{len(search.points)} found, {counted(search.cells, 'cell', 'cells')}, {len(search.waiting)} open"
    return f"all equilibria: {found}{clock.to_go(share)}"
