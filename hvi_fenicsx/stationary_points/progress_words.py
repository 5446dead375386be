"""How far a search is, in words: bounds, gap, open boxes, and about how long it, or the rest of the work, will take.

Each division gives its parts equal shares of the whole search; what is done is what open boxes are not (Knuth 1975,
Mathematics of Computation 29). The time to go follows from the share that is done; it is a rough estimate, since
divisions are not alike.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from .all_points import Enumeration
from .lowest import Progress

LEAST_DONE = 0.01
"""Share of a search that must be done before a time is told."""


@dataclass(frozen=True, kw_only=True)
class Unit:
    """A unit of energy.

    Attributes:
        size: in J or J/m.
        name: J or J/m; empty where there is none.
    """

    size: float = 1.0
    name: str = ""


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
