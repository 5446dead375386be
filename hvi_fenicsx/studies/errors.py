"""What ends a study."""

from __future__ import annotations

from ..errors import ExitCode, HviError


class NoReferenceError(HviError):
    """There is nothing to measure against; the exit code is that of the reference's run."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.exit_code = code


class StudyInterruptedError(HviError):
    """Ctrl-C or SIGTERM: the finished points are kept."""

    exit_code = ExitCode.INTERRUPTED
