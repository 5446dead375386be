"""How many PETSc objects live."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mpi4py import MPI
from petsc4py import PETSc


@contextmanager
def _shared_file(comm: MPI.Comm) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        yield Path(comm.bcast(folder)) / "log"
        comm.Barrier()


def living(comm: MPI.Comm) -> int:
    """PETSc objects of rank 0 that were made since ``PETSc.Log.begin()`` and not destroyed. Collective."""
    with _shared_file(comm) as file:
        viewer = PETSc.Viewer().createASCII(str(file), comm=comm)
        PETSc.Log.view(viewer)
        viewer.destroy()
        comm.Barrier()
        told = file.read_text().partition("Object Type")[2] if comm.rank == 0 else ""
    return sum(int(made) - int(freed) for made, freed in re.findall(r"(\d+) +(\d+)$", told, re.MULTILINE))
