"""The program's exceptions and exit codes: one tree of exceptions, each with the code that it ends in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import IntEnum
from pathlib import Path


class ExitCode(IntEnum):
    """What a command ends with; scripts rely on these numbers (docs/results.md)."""

    CERTIFIED = 0
    """A solution is certified, or the command did what it was asked for."""
    ERROR = 1
    """Anything else."""
    BAD_INPUT = 2
    """The scene or the command line cannot be used, or a file cannot be written."""
    NO_SOLUTION = 3
    """No solution exists: the state is *escapes*."""
    NOT_CONVERGED = 4
    """Not converged, or metastable and no equilibrium found."""
    INTERRUPTED = 130
    """Ctrl-C, SIGTERM, SIGHUP or SIGUSR1; what was found is written."""


class HviError(Exception):
    """Anything the program itself has to say about why it stopped.

    Attributes:
        exit_code: what a command then ends with.
        everywhere: whether all ranks raise it alike.
    """

    exit_code: int = ExitCode.ERROR
    everywhere: bool = True


class InputError(HviError, ValueError):
    """What the user gave cannot be used: what, where, what is allowed, how to mend it."""

    exit_code = ExitCode.BAD_INPUT


class NotWrittenError(InputError):
    """A file could not be written: there is no room for it, or it may not be there.

    Args:
        file: which one.
        reason: why, and how to mend it.
        words: all that is said of it; by default file and reason.
    """

    def __init__(self, file: Path, reason: str, words: str = "") -> None:
        super().__init__(words or f"{file} could not be written: {reason}")
        self.file, self.reason = file, reason

    def __reduce__(self) -> tuple[type[NotWrittenError], tuple[Path, str, str]]:
        """What other ranks make it of."""
        return type(self), (self.file, self.reason, str(self))


@contextmanager
def of_user(what: object) -> Iterator[None]:
    """What Python, NumPy, UFL and dolfinx raise of objects that a program gives is bad input. Decorates functions too.

    Args:
        what: was given, or is called with it.

    Raises:
        InputError: with the kind of the error and its words; the error is its cause. The program's own pass.
    """
    try:
        yield
    except (HviError, KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # UFL's ArityMismatch is no Exception
        raise InputError(f"{what}: {type(error).__name__}: {error}") from error


class SolverError(HviError, RuntimeError):
    """A solver broke down; the message carries PETSc's own name for the reason."""

    exit_code = ExitCode.NOT_CONVERGED


class Interrupted(HviError):
    """A signal came before there was anything to write."""

    exit_code = ExitCode.INTERRUPTED

    def __init__(self, words: str = "interrupted; nothing was written") -> None:
        super().__init__(words)
