"""How much memory the program has used, and how much there is."""

from __future__ import annotations

import os
import resource
import sys
from pathlib import Path

from mpi4py import MPI

from .mpi import total

_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")


def peak(comm: MPI.Comm) -> float:
    """The sum over the ranks of the most memory that each has used at any time, MB. Collective."""
    found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return total(comm, found / 2**20 if sys.platform == "darwin" else found / 2**10)


def limit() -> float:
    """The memory of this machine, or what its container may use of it, MB."""
    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**20
    texts = [Path(file).read_text(encoding="ascii").strip() for file in _LIMITS if Path(file).is_file()]
    return min([machine, *(int(text) / 2**20 for text in texts if text.isdigit())])


def room(comm: MPI.Comm) -> float:
    """The memory of all machines that the ranks run on, MB. Collective."""
    here = comm.Split_type(MPI.COMM_TYPE_SHARED)
    found = total(comm, limit() if here.rank == 0 else 0.0)
    here.Free()
    return found
