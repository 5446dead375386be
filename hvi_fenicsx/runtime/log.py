"""Logging: one logger for each room of the package, on rank 0 only, and what shows a run of the command line.

Python users see nothing unless they configure logging, like ``logging.basicConfig(level=logging.INFO)``; at DEBUG every
Newton step is told. ``hvi run`` shows the lines of the command on the terminal, the last Newton step on a moving line,
and keeps all records in ``run.log``.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

from ..errors import InputError
from . import writing

PACKAGE = __name__.partition(".")[0]
COMMANDS = f"{PACKAGE}.commands"
_STANDARD = 2
"""The last of the descriptors of standard input, output and error."""
logging.getLogger(PACKAGE).addHandler(logging.NullHandler())


@dataclass(frozen=True, kw_only=True, repr=False)
class NewtonStep:
    """One step of a Newton iteration; the same on all ranks.

    Attributes:
        method: the name of the method.
        epsilon: relative width of the smoothing; None for exact laws.
        iteration: counted from the start of the solve, 0 being its start value.
        residual: of the inequality, relative.
        contact: vertices in contact, of all ranks.
    """

    method: str
    epsilon: float | None
    iteration: int
    residual: float
    contact: int

    def __repr__(self) -> str:
        width = "" if self.epsilon is None else f", ε {self.epsilon:.3g}"
        at = f"iteration {self.iteration}, residual {self.residual:.2e}, {self.contact} vertices in contact"
        return f"{self.method}{width}, {at}"


def logger(room: str) -> logging.Logger:
    """The logger of a room, such as ``hvi_fenicsx.solvers``; its records are made on rank 0 only."""
    found = logging.getLogger(f"{PACKAGE}.{room}")
    found.addFilter(_on_first_rank)
    return found


def warn(log: logging.Logger, sentences: Iterable[str]) -> None:
    """Record warnings, each by itself.

    Args:
        log: the logger of a room.
        sentences: the warnings.
    """
    for sentence in sentences:
        log.warning("%s", sentence)


def set_log_level(level: int | str = logging.INFO) -> None:
    """Show what the program does on the terminal (rank 0), as ``logging`` does it. Not collective.

    Args:
        level: such as ``"INFO"``; ``"DEBUG"`` tells every Newton step.

    Raises:
        InputError: there is no such level.
    """
    package = logging.getLogger(PACKAGE)
    try:
        package.setLevel(level)
    except (TypeError, ValueError) as error:
        known = ", ".join(logging.getLevelNamesMapping())
        raise InputError(f"log level: {error}; there are: {known}") from None
    if not any(type(handler) is logging.StreamHandler for handler in package.handlers):
        handler = logging.StreamHandler()
        handler.setFormatter(logging.Formatter("%(name)s: %(message)s"))
        package.addHandler(handler)


def _on_first_rank(record: logging.LogRecord) -> bool:
    """Whether this process is rank 0; one that has not started MPI is alone."""
    mpi = sys.modules.get("mpi4py.MPI")
    return mpi is None or mpi.COMM_WORLD.rank == 0


def _is_not_told_by_commands(record: logging.LogRecord) -> bool:
    """Whether a record is of no logger whose records a command tells in words of its own."""
    return record.name not in (f"{PACKAGE}.preparation", f"{PACKAGE}.workflow")


def newton_step(step: NewtonStep) -> None:
    """Record a Newton step.

    Args:
        step: the step.
    """
    logger("solvers").debug("%s", step, extra={"moving": True})


class RunLog(logging.Handler):
    """``run.log``: each record with the seconds since the start of the run; written when the run ends.

    Args:
        path: the file.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path, self._lines = path, list[str]()
        self.addFilter(_is_not_told_by_commands)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep the line of a record."""
        self._lines.append(f"{record.relativeCreated / 1000:9.3f} s  {printable(record.getMessage())}\n")

    def finish(self) -> None:
        """Write the file.

        Raises:
            NotWrittenError: it could not be written.
        """
        writing.text(self._path, "".join(self._lines))


class WarningDisplay(logging.Handler):
    """Warnings on standard error, except those on a scene, which the command tells with its lines."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.addFilter(_is_not_told_by_commands)

    def emit(self, record: logging.LogRecord) -> None:
        """Show one record."""
        complain(f"hvi: {record.getMessage()}")


class TerminalDisplay(logging.Handler):
    """The lines of the command on standard output; on a terminal also the last Newton step, on a moving line.

    The moving line goes to standard error. It begins at once, and ends when the handler is closed.
    """

    def __init__(self) -> None:
        super().__init__()
        self._start = time.perf_counter()
        self._line: Any = None
        self.addFilter(lambda record: record.name == COMMANDS or hasattr(record, "moving"))
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live
            from rich.spinner import Spinner

            shared = sys.stdout.isatty()  # then lines on standard output go above the moving one
            self._spinner, to = Spinner("line", style="status.spinner"), Console(stderr=True)
            self._line = Live(
                self._spinner, console=to, refresh_per_second=12.5, transient=True, redirect_stdout=shared
            )
            self._line.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Show one record."""
        if not hasattr(record, "moving"):
            say(record.getMessage())
        elif self._line is not None:
            self._spinner.update(text=f"{record.getMessage()}, {time.perf_counter() - self._start:.1f} s")

    def close(self) -> None:
        """Leave the terminal clean."""
        if self._line is not None:
            with contextlib.suppress(OSError):  # the terminal may be closed
                self._line.stop()
            self._line = None
        super().close()


@contextlib.contextmanager
def handled(*handlers: logging.Handler) -> Iterator[None]:
    """Send the package's records to handlers in a block, and close them at its end.

    Args:
        *handlers: where to; none on the ranks that show nothing.
    """
    package = logging.getLogger(PACKAGE)
    level = package.level
    package.setLevel(logging.DEBUG)
    for handler in handlers:
        package.addHandler(handler)
    try:
        yield
    finally:
        for handler in handlers:
            package.removeHandler(handler)
            handler.close()
        package.setLevel(level)


def prepare() -> None:
    """Open what the caller has closed of the standard streams; write characters that a stream lacks as escapes.

    Otherwise the next file that is opened would get the descriptor of a closed one, and what libraries print.
    """
    while (descriptor := os.open(os.devnull, os.O_RDWR)) <= _STANDARD:
        pass
    os.close(descriptor)
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name) or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        setattr(sys, name, stream)
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def say(text: str) -> None:
    """Write lines to standard output."""
    _write(sys.stdout, text)


def complain(text: str) -> None:
    """Write lines to standard error."""
    _write(sys.stderr, text)


def finish() -> None:
    """Write what is still in the buffers, such as a library's lines."""
    for stream in (sys.stdout, sys.stderr):
        _write(stream, "", end="")


def printable(text: str) -> str:
    r"""Text with every character that is not printable as ``\uXXXX``, new lines excepted."""
    return "".join(c if c.isprintable() or c == "\n" else f"\\u{ord(c):04x}" for c in text)


def _write(stream: TextIO, text: str, end: str = "\n") -> None:
    try:
        print(printable(text), end=end, file=stream, flush=True)
    except (OSError, ValueError):  # a broken pipe, a closed terminal, a full disk; a closed stream
        with contextlib.suppress(OSError, ValueError):  # its buffer would raise the same error again at the end
            descriptor = os.open(os.devnull, os.O_WRONLY)
            os.dup2(descriptor, stream.fileno())
            os.close(descriptor)


def percent(share: float) -> str:
    """Two digits and no power of ten, or all digits before the point.

    Args:
        share: of one; from about 1e-6 on.
    """
    return f"{100.0 * share:.0f} %" if share >= 0.1 else f"{100.0 * share:.2g} %"
