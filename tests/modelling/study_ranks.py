"""A study of a model on the ranks of MPI; what each rank is told, as JSON on rank 0."""

from __future__ import annotations

import json

from mpi4py import MPI
from own_mesh import own_square, steel_square

import hvi_fenicsx as hvi

comm = MPI.COMM_WORLD
found = hvi.study(steel_square(body=own_square(comm, 4)), mesh=[0, 1], accuracy=[0.1], repeats=1)
told = comm.gather({row.text: row.error("energy_norm") for row in found.rows}, root=0)
if comm.rank == 0:
    print(json.dumps(told))
