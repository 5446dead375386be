"""What a run says: lines on the terminal and in ``run.log``, and one moving line of progress. Rank 0 only."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import Any, Self


class Journal:
    """Collects what a run says; used as a context so that the terminal is always left clean.

    Args:
        speaks: whether this rank prints (rank 0). The progress line is shown on terminals only.
    """

    def __init__(self, speaks: bool) -> None:
        self.lines: list[str] = []
        self._speaks = speaks
        self._start = time.perf_counter()
        self._status: Any = None

    def __enter__(self) -> Self:
        if self._speaks and sys.stderr.isatty():
            from rich.console import Console

            self._status = Console(stderr=True).status("", spinner="line")
            self._status.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._status is not None:
            self._status.stop()
            self._status = None

    def say(self, line: str) -> None:
        """A line for the terminal and the log."""
        self.note(line)
        if self._speaks:
            print(line, flush=True)

    def note(self, line: str) -> None:
        """A line for the log only."""
        self.lines.append(f"{time.perf_counter() - self._start:9.3f} s  {line}")

    def progress(self, stage: str, epsilon: float | None, iteration: int, residual: float, contact: int) -> None:
        """One step of a solver: in the log, and on the moving line."""
        width = "" if epsilon is None else f", ε {epsilon:.3g}"
        line = f"{stage}{width}, iteration {iteration}, residual {residual:.2e}, {contact} vertices in contact"
        self.note(line)
        if self._status is not None:
            self._status.update(f"{line}, {time.perf_counter() - self._start:.1f} s")
