"""Time by phase, as ``summary.json`` reports it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

PHASES = ("jit", "mesh", "assembly", "existence", "setup", "solve", "certificate", "estimate", "output")


class Timer:
    """Adds up time (s) by phase; the time of an inner phase does not count for the one around it.

    Args:
        clock: seconds since any moment; by default wall time, ``time.perf_counter`` as it is when the timer is made.

    Attributes:
        seconds: by phase, s.
    """

    def __init__(self, clock: Callable[[], float] | None = None) -> None:
        self._clock = clock or time.perf_counter
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._start = self._clock()
        self._inner: list[float] = []

    @contextmanager
    def __call__(self, phase: str) -> Iterator[None]:
        """Time a block as one phase."""
        start = self._clock()
        self._inner.append(0.0)
        try:
            yield
        finally:
            elapsed = self._clock() - start
            self.seconds[phase] += elapsed - self._inner.pop()
            if self._inner:
                self._inner[-1] += elapsed

    @property
    def total(self) -> float:
        """Seconds since the timer was made."""
        return self._clock() - self._start

    def report(self) -> dict[str, float]:
        """Seconds by phase, with the total."""
        return {**self.seconds, "total": self.total}
