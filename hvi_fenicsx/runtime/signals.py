"""Signals as a request to stop: the solvers end at the next iteration, the result is written.

SIGINT is Ctrl-C, SIGHUP comes from a terminal that is closed, SIGTERM from a batch system. SIGUSR1 is what mpirun
passes on to its ranks, and what a batch system may send before a job's end.
"""

from __future__ import annotations

import signal
from types import FrameType

from mpi4py import MPI

from . import processes

SIGNALS = (*processes.STOP, signal.SIGUSR1)


class Interrupt:
    """The request to stop, made by the first signal; a second one ends the program at once.

    Args:
        comm: the ranks that stop together.
    """

    def __init__(self, comm: MPI.Comm) -> None:
        self._comm, self._signalled = comm, False

    def watch(self) -> None:
        """Catch the signals from now on."""
        processes.catch(SIGNALS, self._on_signal)

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._signalled:
            raise KeyboardInterrupt
        self._signalled = True

    def requested(self) -> bool:
        """Whether any rank was signalled. Collective."""
        return bool(self._comm.allreduce(self._signalled, op=MPI.LOR))
