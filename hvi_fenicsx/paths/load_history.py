"""A history of load factors, gone to one after the other, and why a path ends on its way: cycles are detected."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from enum import Enum

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .state import End, Event, PathOptions, PathState, Stopped, Watch


class LoadHistory(ABC):
    """Goes through a history of load factors.

    Args:
        problem: the problem.
        options: what path is wanted.
        resume: the state after which to go on; by default the path begins at factor 0.
        watch: whether to stop, asked at each state and within jumps, and who is told of these.

    Attributes:
        end: how the path ended; None before.
        reason: that in a sentence.
        is_closed: whether it is lost because its equilibria form a closed curve, which it has gone round.
    """

    def __init__(
        self,
        problem: CondensedProblem,
        options: PathOptions,
        resume: PathState | None = None,
        watch: Watch | None = None,
    ) -> None:
        self._problem, self._options = problem, options
        self._resume, self._watcher = resume, watch or Watch()
        self._leg, self._events, self._peak = 0, 0, 0.0
        self._floats = len(problem.elastic.rigid) > 0
        self._adrift = False
        self.end: End | None = None
        self.reason, self.is_closed = "", False

    def states(self) -> Iterator[PathState]:
        """The states from start to end; the first one of a path that is resumed is the next one."""
        try:
            yield from self._all_states()
        except Stopped:
            self._finish(End.INTERRUPTED, "interrupted")
        except np.linalg.LinAlgError:
            self._finish(End.LOST, "after the last state the equations of the path are singular")

    def _all_states(self) -> Iterator[PathState]:
        if self._resume is None:
            yield from self._first_states()
        else:
            self._restore(self._resume)
            self._peak = max(map(abs, self._options.programme[: self._leg]), default=0.0)
            self._adrift = self._resume.event not in (Event.START, Event.JUMP) and self._is_adrift()
        programme = self._options.programme
        while self.end is None and self._leg < len(programme):
            yield from self._gone_to(programme[self._leg])
            self._leg += 1
            if self.end is None:
                yield self._after_leg(programme)
        if self.end is None:  # resumed from its last state
            self._finish(End.REACHED, "the programme is done")

    def _first_states(self) -> Iterator[PathState]:
        """The first state; none where its factor is not borne."""
        low, high = self._options.borne
        if low <= self._small and high >= -self._small:
            yield from self._begun()
        else:
            self._finish(End.ESCAPES, "no equilibrium bears the constant loads alone: a body comes off")

    def _gone_to(self, aim: float) -> Iterator[PathState]:
        """A leg; none where no factor on it is borne."""
        limit, way = self._limit(self.factor), 1.0 if aim >= self.factor else -1.0
        if way * (aim - limit) > 0.0 and way * (self.factor - limit) >= -self._small:
            self._finish(End.ESCAPES, self._not_borne(limit))
            yield self._state(Event.END)
        else:
            yield from self._towards(aim)

    @property
    def _small(self) -> float:
        """A difference of factors that does not count."""
        return self._options.thresholds.slow * max(map(abs, self._options.programme))

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

    def _after_leg(self, programme: Sequence[float]) -> PathState:
        if self._leg < len(programme):
            return self._state(Event.TURN)
        self._finish(End.REACHED, "the programme is done")
        return self._state(Event.END)

    @property
    @abstractmethod
    def factor(self) -> float:
        """λ."""

    @abstractmethod
    def _begun(self) -> Iterator[PathState]:
        """The first state; none where the path ends before."""

    @abstractmethod
    def _restore(self, state: PathState) -> None:
        """Go on after a state."""

    @abstractmethod
    def _towards(self, aim: float) -> Iterator[PathState]:
        """From event to event until the factor reaches its aim or the path ends."""

    @abstractmethod
    def _state(self, event: Event) -> PathState:
        """The present state."""

    @abstractmethod
    def _is_off(self) -> bool:
        """Whether no load, law or bound acts any more, and nothing would resist the next load."""

    def _is_adrift(self) -> bool:
        """Whether the load is back at zero and the body free; where any load is borne, the next one takes it up."""
        return self._floats and self._peak > 0.0 and self._is_off()

    def _watch(self) -> None:
        """Count an event; end the path where it has a reason to."""
        self._events += 1
        self._peak = max(self._peak, abs(self.factor))
        self._adrift = self._is_adrift()
        if self._adrift and not self._is_held(self.factor):
            self._finish(End.ESCAPES, "the load is back at zero, and nothing holds the body any more")
        elif self._watcher.interrupted():
            self._finish(End.INTERRUPTED, "interrupted")
        elif self._events > self._options.most_events:
            self._lose(self.factor, f"no end after {self._options.most_events} events")

    def _go_round(self, found: Cycle) -> None:
        """End where the path has come back to where it was."""
        self.is_closed = found is Cycle.CLOSED
        where = f"at the factor {self.factor:.6g} the path comes back to where it was"
        self._lose(self.factor, f"{where}: {found.value}")

    def _finish(self, end: End, reason: str) -> None:
        self.end, self.reason = end, reason

    def _is_held(self, factor: float) -> bool:
        """Whether there is an equilibrium at a factor whatever the bonds remember, as far as that is known."""
        low, high = self._options.held
        return low + self._small < factor < high - self._small

    def _end_before(self, reason: str, *, escapes: bool) -> None:
        """End before the first state."""
        (self._come_off if escapes else self._lose)(0.0, reason)

    def _come_off(self, factor: float, reason: str) -> None:
        """End where the way that was tried leads off; that proves nothing where the body is held."""
        if self._is_held(factor):
            self._finish(End.LOST, f"{reason}, on the way that was tried; the body is held there, so the path is lost")
        else:
            self._finish(End.ESCAPES, reason)

    def _end_for_ever(self, *, stands: bool) -> None:
        """End where nothing ends the curve: where the factor stands, a body comes off."""
        if stands:
            self._come_off(self.factor, f"at the factor {self.factor:.6g} a body comes off")
        else:
            self._lose(self.factor, "the path leads away from the wanted factor for ever")

    def _end_jump(self, *, escapes: bool) -> None:
        """End in a jump that leads to no equilibrium."""
        if escapes:
            self._come_off(self.factor, f"at the factor {self.factor:.6g} no equilibrium is left: a body comes off")
        else:
            self._lose(self.factor, f"no stable equilibrium found at the factor {self.factor:.6g}")

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
    BLOCKED = "several bonds are at ends of their pieces at once, and no combination of their directions leads on"


class Cycles:
    """The events of one leg of a load history, by statuses and direction. Positions are kept as numbers of 64 bits.

    Args:
        x: the displacements where the leg begins, (n,).
        same_place: a difference of displacements that does not count, relative.

    Attributes:
        came: the last change of the displacements, (n,).
        standing: events in a row at one place and factor.
    """

    def __init__(self, x: Array, same_place: float) -> None:
        self._same_place = same_place
        self._known: dict[int, tuple[float, float, float]] = {}
        self._x, self.came = x, np.zeros_like(x)
        self._weights = np.random.default_rng(0).uniform(0.5, 1.5, len(x))
        self._way, self._factor, self.standing = 0.0, np.inf, 0

    def note(self, state: PathState) -> Cycle | None:
        """Note a state; says how the path came back to it, or None if it is new.

        Args:
            state: of an event.
        """
        step, size = state.x - self._x, float(np.max(np.abs(state.x), initial=0.0))
        length = float(np.max(np.abs(step), initial=0.0))
        if length > 1e-9 * size:
            self.came = step
        self._way += length
        stands = length <= 1e-9 * size and abs(state.factor - self._factor) <= 1e-9 * (1.0 + abs(state.factor))
        self._factor, self.standing = state.factor, self.standing + 1 if stands else 0
        self._x, key = state.x, _key(state)
        factor, way, place = self._known.get(key, (np.inf, 0.0, 0.0))
        here = float(self._weights @ state.x)
        self._known[key] = state.factor, self._way, here
        if abs(factor - state.factor) > 1e-9 * (1.0 + abs(state.factor)):
            return None
        if abs(place - here) > self._same_place * float(self._weights @ np.abs(state.x)):
            return None  # what slides bears the same load
        return Cycle.CLOSED if self._way - way > 1e-9 * size else Cycle.BLOCKED


def _key(state: PathState) -> int:
    position = state.position
    memory = b"" if state.memory is None else state.memory.tobytes()
    return hash((position.numbers.tobytes(), position.driver, position.heading, memory))
