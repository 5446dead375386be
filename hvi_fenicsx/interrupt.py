"""Ctrl-C and SIGTERM as a request that the solvers heed at the next iteration, so that what was found is written."""

from __future__ import annotations

import signal
from types import FrameType

from mpi4py import MPI


class Interrupt:
    """Catches the first signal; a second one ends the program at once."""

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm, self._seen = comm, False

    def watch(self) -> None:
        """Take over SIGINT and SIGTERM."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._seen:
            raise KeyboardInterrupt
        self._seen = True

    def requested(self) -> bool:
        """Whether any rank was signalled. Collective."""
        return bool(self._comm.allreduce(self._seen, op=MPI.LOR))
