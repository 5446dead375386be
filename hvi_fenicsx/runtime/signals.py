"""Ctrl-C, SIGTERM and SIGUSR1 as a request to stop: the solvers end at the next iteration, the result is written.

SIGUSR1 is what mpirun passes on to its ranks, and what a batch system may send before a job's end.
"""

from __future__ import annotations

import signal
from types import FrameType

from mpi4py import MPI

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)


class Interrupt:
    """The request to stop, made by the first signal; a second one ends the program at once.

    Args:
        comm: the ranks that stop together.
    """

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm, self._signalled = comm, False

    def watch(self) -> None:
        """Catch the signals from now on."""
        for number in SIGNALS:
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._signalled:
            raise KeyboardInterrupt
        self._signalled = True

    def requested(self) -> bool:
        """Whether any rank was signalled. Collective."""
        return bool(self._comm.allreduce(self._signalled, op=MPI.LOR))
