"""Where a path is in its history of load factors, and why it ends on its way: cycles are detected."""

from __future__ import annotations

from enum import Enum

import numpy as np

from ..typing import Array
from .state import End, PathOptions, PathState


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

    def _go_round(self, factor: float, found: Cycle) -> None:
        """End where the path has come back to where it was."""
        self.is_closed = found is Cycle.CLOSED
        self._lose(factor, f"at the factor {factor:.6g} the path comes back to where it was: {found.value}")

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
