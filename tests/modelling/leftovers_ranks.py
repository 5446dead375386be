"""PETSc objects that live when a solve with its estimate ends, before its system is freed. Run under mpirun."""

from __future__ import annotations

import json

from mpi4py import MPI
from petsc4py import PETSc
from petsc_objects import living
from scenes import model

import hvi_fenicsx as hvi
from hvi_fenicsx.system.system import System

COMM = MPI.COMM_WORLD
STUCK_AND_DROPPING = {"law": "graph", "points": [[0, 4e5], [9e-6, 1e6], [9e-6, 5e5], [2e-5, 5e5], [2e-5, 2e5]]}
free, counts = System.free, list[int]()


def counted(system: System) -> None:
    counts.append(living(COMM))
    free(system)


System.free = counted  # type: ignore[method-assign]
PETSc.Log.begin()
hvi.solve(hvi.read_tables(model(12, 3e6, friction=STUCK_AND_DROPPING)), COMM)
if COMM.rank == 0:
    print(json.dumps(max(counts)))
