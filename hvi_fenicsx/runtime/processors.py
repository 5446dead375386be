"""The machine that a rank runs on, and whether it has a processor without a rank."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from mpi4py import MPI


@contextlib.contextmanager
def on_this_machine(comm: MPI.Comm) -> Iterator[MPI.Comm]:
    """The ranks of this rank's machine. Collective.

    Args:
        comm: all ranks.
    """
    here = comm.Split_type(MPI.COMM_TYPE_SHARED)
    try:
        yield here
    finally:
        here.Free()


def is_processor_free(comm: MPI.Comm) -> bool:
    """Whether this rank's machine has more processors than ranks. Collective.

    The processors are those of the machine: an mpirun may bind each rank to one.

    Args:
        comm: all ranks.
    """
    with on_this_machine(comm) as here:
        return here.size < (os.cpu_count() or 1)
