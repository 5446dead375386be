"""What a run costs: its time by phase, the memory that it has used, and how much there is."""

from __future__ import annotations

import math
import os
import resource
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mpi4py import MPI

from .mpi import total

PHASES = ("jit", "mesh", "assembly", "existence", "setup", "solve", "certificate", "estimate", "output")


class Timer:
    """Adds up time (s) by phase; the time of an inner phase does not count for the one around it.

    Attributes:
        seconds: by phase, s.
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PHASES, 0.0)
        self._start = time.perf_counter()
        self._inner: list[float] = []

    @contextmanager
    def __call__(self, phase: str) -> Iterator[None]:
        """Time a block as one phase."""
        start = time.perf_counter()
        self._inner.append(0.0)
        try:
            yield
        finally:
            elapsed = time.perf_counter() - start
            self.seconds[phase] += elapsed - self._inner.pop()
            if self._inner:
                self._inner[-1] += elapsed

    @property
    def total(self) -> float:
        """Seconds since the timer was made."""
        return time.perf_counter() - self._start

    def report(self) -> dict[str, float]:
        """Seconds by phase, with the total."""
        return {**self.seconds, "total": self.total}


_CGROUPS = Path("/sys/fs/cgroup")
_PLANE, _ADAPTIVE = 1.3, 3.0
"""KB that an unknown of a plane body takes, by multigrid on a mesh refined uniformly or not; in space twice."""


def memory_needed(unknowns: float, dimension: int) -> float:
    """What so many unknowns take at least, MB, from the mesh to the estimate (measured: docs/benchmarks.md).

    Args:
        unknowns: on all ranks together.
        dimension: 2 or 3.
    """
    return unknowns * _PLANE * (dimension - 1) / 1024


def memory_of_all_meshes(unknowns: float, dimension: int, degree: int) -> float:
    """What a mesh that was refined where the error is takes, about, MB: all coarser ones are kept, too.

    Args:
        unknowns: of the finest.
        dimension: 2 or 3.
        degree: of the elements.
    """
    return unknowns * _ADAPTIVE * (dimension - 1) * degree / 1024


def peak_memory(comm: MPI.Comm) -> float:
    """The sum over the ranks of the most memory that each has used at any time, MB. Collective."""
    found = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return total(comm, found / 2**20 if sys.platform == "darwin" else found / 2**10)


def free_memory() -> float:
    """What no process uses now of the memory that this one may use, MB, as far as the machine tells."""
    table = Path("/proc/meminfo")
    lines = table.read_text(encoding="ascii").splitlines() if table.is_file() else []
    found = [int(line.split()[1]) / 2**10 for line in lines if line.startswith("MemAvailable:")]
    return min([_of_machine(), _of_process(), *found])


def memory_room(comm: MPI.Comm) -> float:
    """The memory of all machines that the ranks run on, as far as they may use it, MB. Collective."""
    here = comm.Split_type(MPI.COMM_TYPE_SHARED)
    machines = total(comm, _of_machine() if here.rank == 0 else 0.0)
    here.Free()
    return min(machines, total(comm, _of_process()))


def _of_machine() -> float:
    """The memory of this machine, or of the cgroup that all its ranks share, MB."""
    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**20
    return min([machine, *cgroup_limits(Path("/proc/self/cgroup"), _CGROUPS)])


def _of_process() -> float:
    """What this process may take by ``ulimit``, MB; infinite: all."""
    soft = [resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA)]
    return min([math.inf, *(bound / 2**20 for bound in soft if bound != resource.RLIM_INFINITY)])


def cgroup_limits(table: Path, mounted: Path) -> list[float]:
    """The limits of the cgroup (version 2) that a process is in, and of those around it, MB.

    Args:
        table: which one this is, as in ``/proc/self/cgroup``.
        mounted: where cgroups are mounted.
    """
    lines = table.read_text(encoding="ascii").splitlines() if table.is_file() else []
    inner = [mounted / line.removeprefix("0::/") for line in lines if line.startswith("0::/")]
    files = [folder / "memory.max" for one in inner for folder in (one, *one.parents) if folder.is_relative_to(mounted)]
    texts = [file.read_text(encoding="ascii").strip() for file in files if file.is_file()]
    return [int(text) / 2**20 for text in texts if text.isdigit()]
