"""Ctrl-C, SIGTERM and SIGUSR1 as a request that the solvers heed at the next iteration: what was found is written.

SIGUSR1 is what mpirun hands on to its ranks, and what a batch system may send ahead of a job's end.
"""

from __future__ import annotations

import signal
from types import FrameType

from mpi4py import MPI

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)


class Interrupt:
    """Catches the first signal; a second one ends the program at once."""

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm, self._seen = comm, False

    def watch(self) -> None:
        """Take over the signals."""
        for number in SIGNALS:
            signal.signal(number, self._note)

    def _note(self, number: int, frame: FrameType | None) -> None:
        if self._seen:
            raise KeyboardInterrupt
        self._seen = True

    def requested(self) -> bool:
        """Whether any rank was signalled. Collective."""
        return bool(self._comm.allreduce(self._seen, op=MPI.LOR))
