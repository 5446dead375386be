"""What a follower asks and tells on its way, in the middle of a long jump too."""

from __future__ import annotations

import time
from collections.abc import Callable


class Stopped(Exception):
    """The path was asked to stop between two states: it ends with the one before."""


class Watch:
    """Whether to stop, and who is told of a jump's steps.

    Args:
        interrupted: whether to stop, asked at each state, at each step of a jump, and as each site passes.
        jumping: is told the factor of a long jump and its steps so far.
        seconds: from one time that it is told to the next.
    """

    def __init__(
        self,
        interrupted: Callable[[], bool] = lambda: False,
        jumping: Callable[[float, int], None] = lambda factor, steps: None,
        seconds: float = 1.0,
    ) -> None:
        self.interrupted, self._jumping, self._seconds = interrupted, jumping, seconds
        self._factor, self._steps, self._told = 0.0, 0, 0.0

    def jumps(self, factor: float) -> None:
        """Begin a jump.

        Args:
            factor: λ.
        """
        self._factor, self._steps, self._told = factor, 0, time.monotonic()

    def check(self) -> None:
        """Go on, or not.

        Raises:
            Stopped: the path is to stop.
        """
        if self.interrupted():
            raise Stopped

    def step(self) -> None:
        """One step of the jump is next.

        Raises:
            Stopped: it is not to be taken.
        """
        self.check()
        self._steps += 1
        if time.monotonic() - self._told >= self._seconds:
            self._told = time.monotonic()
            self._jumping(self._factor, self._steps)
