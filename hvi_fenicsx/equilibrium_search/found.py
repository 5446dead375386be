"""What is asked of a search, and what it found: how much of it is proven, and what is needed to go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from ..typing import Array
from .scalar_problem import ScalarProblem
from .stationarity import Kind, StationaryPoint

Saved = Mapping[str, Array]
"""What is left of an unfinished search: arrays, by name."""
Keep = Callable[[Callable[[], Saved]], None]
"""Is given, after each box, what makes the state to go on from."""
Refined = Callable[[float, Array], ScalarProblem]
"""A problem with polylines nearer to curved laws: by the difference of the energies and where it counts, (n,)."""


def forget(state: Callable[[], Saved]) -> None:
    """Keep nothing.

    Args:
        state: makes what could be kept.
    """


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
class Task:
    """A search to be made.

    Attributes:
        problem: the problem.
        lowest: the lowest energy with a proof; else all equilibria.
        gap: relative gap that the proof of the lowest may leave.
        stop: asked before each box, and inside long steps.
        report: told how far it is, in words.
        saved: what an earlier search of the same problem left.
        keep: keeps what is left while the search goes on.
        bounded: whether the energy is known to be bounded from below.
        has_potential: whether all laws are derivatives of an energy.
        no_lowest: why there is no lowest energy; empty where there may be one.
        known: points near which equilibria are known to be, (n,) each.
        unit: of energies in reports.
        exact: makes a point near an equilibrium exact; None where there is none near it.
        refined: follows curved laws more closely.
    """

    problem: ScalarProblem
    lowest: bool = False
    gap: float = 1e-8
    stop: Callable[[], bool] = lambda: False
    report: Callable[[str], None] = lambda _: None
    saved: Saved | None = None
    keep: Keep = forget
    bounded: bool = True
    has_potential: bool = True
    no_lowest: str = ""
    known: tuple[Array, ...] = ()
    unit: Unit = field(default_factory=Unit)
    exact: Callable[[Array], StationaryPoint | None] | None = None
    refined: Refined | None = None

    @property
    def unproven(self) -> str:
        """The laws of which it cannot be proven that all equilibria are found; empty where there are none."""
        if not self.has_potential:
            return "laws whose energy of separation depends on the mode"
        if len(self.problem.lengths):
            return "laws that act on a length"
        return "curved laws" if self.problem.error else ""


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

    points: tuple[StationaryPoint, ...] = ()
    complete: bool = False
    lower_bound: float | None = None
    proven: bool = False
    nodes: int = 0
    reason: str
    left: Saved = field(default_factory=dict)

    @classmethod
    def only(cls, x: Array, energy: float, reason: str) -> Found:
        """The only equilibrium, proven.

        Args:
            x: where it is, (n,).
            energy: there.
            reason: how it is proven.
        """
        point = StationaryPoint(x=x, energy=energy, kind=Kind.MINIMISER)
        return cls(points=(point,), complete=True, lower_bound=energy, proven=True, reason=reason)

    @property
    def gap(self) -> float | None:
        """Lowest energy found minus lower bound, relative to that energy; None where there is no bound."""
        if self.lower_bound is None or not self.points:
            return None
        lowest = self.points[0].energy
        return max(lowest - self.lower_bound, 0.0) / (abs(lowest) or 1.0)


def counted(count: int, one: str, several: str) -> str:
    """A number with the words for what is counted.

    Args:
        count: the number.
        one: words for one.
        several: words for another number.
    """
    return f"{count} {one if count == 1 else several}"


def certified_in_words(done: int, count: int) -> str:
    """How many of the equilibria found are certified, and written where they are written.

    Args:
        done: so many.
        count: of so many.
    """
    return f"certified: {done} of {count} equilibria"
