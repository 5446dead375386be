"""What a study shows while it runs: a moving line with a bar and the time to go, on terminals only."""

from __future__ import annotations

import contextlib
import sys
import time
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from ..runtime import log

_LOG = log.logger("studies")


class StudyProgress:
    """The progress of a study; used as a context, so that the terminal is always left clean."""

    def __init__(self) -> None:
        self._start = time.perf_counter()
        seen = sys.stderr.isatty()
        self._bar = Progress(
            BarColumn(24),
            MofNCompleteColumn(),
            TextColumn("{task.description}"),
            console=Console(stderr=True, quiet=not seen),
            transient=True,
            disable=not seen,
        )
        self._task = self._bar.add_task("")

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with contextlib.suppress(OSError):  # the terminal may be closed
            self._bar.stop()

    @property
    def seconds(self) -> float:
        """Since it was made."""
        return time.perf_counter() - self._start

    def show(self, point: str, *, done: int, total: int, to_go: float) -> None:
        """Show which point is being run.

        Args:
            point: its setting.
            done: points that are finished.
            total: all points.
            to_go: seconds that the rest will take.
        """
        text = f"about {_duration(to_go)} to go · {point}"
        _LOG.info("%d of %d points are finished, %s", done, total, text)
        self._bar.update(self._task, description=text, completed=done, total=total)


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{max(1, round(seconds))} s"
    return f"{round(seconds / 60)} min" if seconds < 5400.0 else f"{seconds / 3600:.1f} h"
