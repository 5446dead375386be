"""The program's exceptions: one tree, each with the exit code it ends in."""

from __future__ import annotations


class HviError(Exception):
    """Anything the program itself has to say about why it stopped."""

    exit_code = 1


class InputError(HviError, ValueError):
    """What the user gave cannot be used: what, where, what is allowed, how to mend it."""

    exit_code = 2


class SolverError(HviError, RuntimeError):
    """A solver broke down; the message carries PETSc's own name for the reason."""

    exit_code = 4
