"""Does a path come back to where it has been? Statuses leave one line: it then goes round for ever."""

from __future__ import annotations

from enum import Enum

import numpy as np

from ..typing import Array
from .state import PathState


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
