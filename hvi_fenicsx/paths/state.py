"""What is asked of a follower and what it reports: states, how a path ended, and its history of load factors."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum

import numpy as np

from ..typing import Array, Integers, magnitude
from .thresholds import DEFAULT


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


@dataclass(frozen=True, kw_only=True)
class Position:
    """Where on its curve a path is: with factor, unknowns and memory all that it needs to go on.

    Attributes:
        leg: number of the programme's part that comes next.
        numbers: of the segments on which the unknowns are, (n,).
        driver: the variable that drives.
        heading: its direction, 1 or -1.
        z: the coordinates of the points, (n,).
        small: parts of the order ε of them, which say who comes first where several come at once, (n,).
        step: length of the next step on a curve that is not straight, which has no such parts.
    """

    leg: int
    numbers: Integers
    driver: int
    heading: int
    z: Array
    small: Array | None = None
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
        way: how a jump was found.
        unstable: number of directions in which the energy falls.
        memory: what the bonds remember, (bonds, 4) as :attr:`.VertexLaws.memory`; None without memory.
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
    way: str = ""
    unstable: int
    memory: Array | None
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
    """

    programme: Sequence[float] = (1.0,)
    follow: Follow = Follow.STABLE
    remember: Collection[int] = ()
    most_events: int = 1_000_000
    borne: tuple[float, float] = (-np.inf, np.inf)
    held: tuple[float, float] = (0.0, 0.0)
    stops: Sequence[float] = ()


class Stopped(Exception):
    """The path was asked to stop between two states: it ends with the one before."""


class LoadHistory:
    """A history of load factors that are gone to one after the other, and the end of a path through it.

    Args:
        options: what path is wanted.

    Attributes:
        end: how the path ended; None before.
        reason: that in a sentence.
        is_closed: whether it is lost because its equilibria form a closed curve, which it has gone round.
    """

    def __init__(self, options: PathOptions) -> None:
        self._options, self._leg = options, 0
        self.end: End | None = None
        self.reason, self.is_closed = "", False

    @property
    def _small(self) -> float:
        """A difference of factors that does not count."""
        return DEFAULT.slow * max(map(abs, self._options.programme))

    def _limit(self, factor: float) -> float:
        """The last factor that may be borne, from one on towards the aim of the present leg."""
        (low, high), programme = self._options.borne, self._options.programme
        return high if programme[min(self._leg, len(programme) - 1)] >= factor else low

    def _not_borne(self, limit: float) -> str:
        """Why a path ends at a limit of the factors that may be borne."""
        low, high = self._options.borne
        side = "but" if high - low <= self._small else "above" if limit == high else "below"
        shown = 0.0 if abs(limit) <= self._small else limit
        return f"no factor {side} {shown:.6g} is borne by any equilibrium: a body comes off"

    def _finish(self, end: End, reason: str) -> None:
        self.end, self.reason = end, reason

    def _is_held(self, factor: float) -> bool:
        """Whether there is an equilibrium at a factor whatever the bonds remember, as far as that is known."""
        low, high = self._options.held
        return low + self._small < factor < high - self._small

    def _come_off(self, factor: float, reason: str) -> None:
        """End where the way that was tried leads off; that proves nothing where the body is held."""
        if self._is_held(factor):
            self._finish(End.LOST, f"{reason}, on the way that was tried; the body is held there, so the path is lost")
        else:
            self._finish(End.ESCAPES, reason)

    def _lose(self, factor: float, reason: str) -> None:
        """End without an answer; where no factor beyond is borne, that is one."""
        limit = self._limit(factor)
        if abs(factor - limit) <= self._small:
            self._finish(End.ESCAPES, self._not_borne(limit))
        else:
            self._finish(End.LOST, reason)


class Cycle(Enum):
    """How a path came back."""

    CLOSED = "its equilibria form a closed curve, which it has gone round: none of them has the wanted factor"
    BLOCKED = "several bonds are at ends of their pieces at once, and the way on leads back"


class Cycles:
    """The events of one leg of a load history, by statuses and direction. Positions are kept as numbers of 64 bits.

    Args:
        x: the displacements where the leg begins, (n,).

    Attributes:
        standing: events in a row at one place and factor.
    """

    def __init__(self, x: Array) -> None:
        self._known: dict[int, tuple[float, float, float]] = {}
        self._x = x
        self._weights = np.random.default_rng(0).uniform(0.5, 1.5, len(x))
        self._way, self._factor, self.standing = 0.0, np.inf, 0

    def note(self, state: PathState) -> Cycle | None:
        """Note a state; says how the path came back to it, or None if it is new.

        Args:
            state: of an event.
        """
        size, length = (magnitude(x) for x in (state.x, state.x - self._x))
        self._way += length
        stands = length <= 1e-9 * size and abs(state.factor - self._factor) <= 1e-9 * (1.0 + abs(state.factor))
        self._factor, self.standing = state.factor, self.standing + 1 if stands else 0
        position, memory = state.position, b"" if state.memory is None else state.memory.tobytes()
        key = hash((position.numbers.tobytes(), position.driver, position.heading, memory))
        self._x = state.x
        factor, way, place = self._known.get(key, (np.inf, 0.0, 0.0))
        here = float(self._weights @ state.x)
        self._known[key] = state.factor, self._way, here
        if abs(factor - state.factor) > 1e-9 * (1.0 + abs(state.factor)):
            return None
        if abs(place - here) > DEFAULT.undecided * float(self._weights @ np.abs(state.x)):
            return None  # what slides bears the same load
        return Cycle.CLOSED if self._way - way > 1e-9 * size else Cycle.BLOCKED
