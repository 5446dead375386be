"""What is asked of a follower, and what it reports: the states along a load path, and how the path ended."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import StrEnum

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, Integers
from .thresholds import DEFAULT, FollowingThresholds


class Event(StrEnum):
    """Why a state is reported."""

    START = "start"
    KINK = "kink"
    """A vertex passes from one piece of its law to another."""
    CONTACT = "contact"
    RELEASE = "release"
    FOLD = "fold"
    """The factor turns."""
    JUMP = "jump"
    """The body has jumped to the next stable equilibrium."""
    TURN = "turn"
    """The programme turns."""
    STEP = "step"
    """Nothing happens; on a curve that is not straight the states between two events."""
    END = "end"


class Follow(StrEnum):
    """How a path goes on where it is no longer stable."""

    STABLE = "stable"
    """On to the next stable equilibrium at the same loads."""
    EXACT = "exact"
    """Along the curve of all equilibria, the factor rising and falling."""


class End(StrEnum):
    """How a path ended."""

    REACHED = "reached"
    ESCAPES = "escapes"
    LOST = "lost"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, kw_only=True)
class EventPlace:
    """Where an event happened.

    Attributes:
        part: boundary part.
        unknown: number of the condensed unknown.
        point: its vertex, m, (3,).
    """

    part: str
    unknown: int
    point: Array


def place_of(problem: CondensedProblem, unknown: int, group: int | None) -> EventPlace:
    """Where an event happened at an unknown: at the part of a law or, where a contact closes or opens, of the contact.

    Args:
        problem: the problem.
        unknown: its number.
        group: number of the problem's bonds; None: a contact.
    """
    part = problem.parts[unknown] if group is None else problem.bonds[group].part
    return EventPlace(part=part, unknown=unknown, point=problem.points[unknown])


@dataclass(frozen=True, kw_only=True)
class Position:
    """Where on its curve a path is: with factor, unknowns and memory all that it needs to go on.

    Attributes:
        leg: number of the programme's part that comes next.
        numbers: of the segments on which the unknowns are, (n,).
        driver: the variable that drives.
        heading: its direction, 1 or -1.
        small: parts of the order ε of the coordinates, which say who comes first where several come at once, (n,);
            on a curve that is not straight its coordinates.
        step: length of the next step on such a curve.
    """

    leg: int
    numbers: Integers
    driver: int
    heading: int
    small: Array
    step: float = 0.0


@dataclass(frozen=True, kw_only=True)
class PathState:
    """An equilibrium on a path, nondimensional.

    Attributes:
        factor: λ.
        event: why it is reported.
        place: where that happened; None where it is not at one vertex.
        x: the condensed unknowns, (n,).
        energy: ½ a(u, u) - <g, u> + what the bonds would give back.
        work: of loads and of what moves prescribed displacements, since the start.
        dissipated: lost in bonds with memory.
        released: at a jump, what the body has lost in motion.
        unstable: number of directions in which the energy falls.
        memory: what the bonds remember, (bonds, 4) as :attr:`.BondTable.memory`; None without memory.
        bifurcation: several vertices reached an end at once, and not all of them went on: there are other branches.
        position: where on its curve the path is.
    """

    factor: float
    event: Event
    place: EventPlace | None
    x: Array
    energy: float
    work: float
    dissipated: float
    released: float = 0.0
    unstable: int
    memory: Array | None
    bifurcation: bool = False
    position: Position

    @property
    def stable(self) -> bool:
        """Whether it is."""
        return self.unstable == 0


@dataclass(frozen=True, kw_only=True)
class PathOptions:
    """What path is wanted.

    Attributes:
        programme: the factors to go to, one after the other, from 0.
        follow: how to go on where the path is not stable.
        remember: numbers of the problem's bonds that remember.
        most_events: events at most.
        borne: the least and the largest factor with which there may be an equilibrium, where these are known.
        held: between these factors there is one, whatever the bonds remember; as far as that is known.
        stops: factors at which a path that is not straight has a state, each time it comes to one.
        thresholds: the numbers that tune how it is followed.
    """

    programme: Sequence[float] = (1.0,)
    follow: Follow = Follow.STABLE
    remember: Collection[int] = ()
    most_events: int = 1_000_000
    borne: tuple[float, float] = (-float("inf"), float("inf"))
    held: tuple[float, float] = (0.0, 0.0)
    stops: Sequence[float] = ()
    thresholds: FollowingThresholds = DEFAULT


class Stopped(Exception):
    """The path was asked to stop between two states: it ends with the one before."""
