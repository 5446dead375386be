"""PETSc objects that live, and resident memory, MB, after some and after more calls from Python, as JSON.

Run under mpirun.
"""

from __future__ import annotations

import gc
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mpi4py import MPI
from petsc4py import PETSc
from petsc_objects import living
from scenes import model, quadratic_linear

import hvi_fenicsx as hvi

COMM = MPI.COMM_WORLD
LAW = {"law": "graph", "points": [[0, 0], [1e-5, 3e6], [1e-5, 1e6]]}
FEW, MORE = 4, 24


def resident() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return float(COMM.allreduce(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, op=MPI.MAX))


def measured(call: Callable[[], Any]) -> dict[str, list[float]]:
    found: dict[str, list[float]] = {"objects": [], "memory": []}
    for number in range(1, MORE + 1):
        call()
        if number in (FEW, MORE):
            gc.collect()
            found["objects"].append(living(COMM))
            found["memory"].append(resident())
    return found


def followed(scene: hvi.Model) -> None:
    path = hvi.follow(scene, COMM)
    path.u(-1)
    path.free()


def main() -> None:
    PETSc.Log.begin()
    small = hvi.read_tables(model(12, 3e6, friction=LAW))
    curved = hvi.read_tables(model(3, 3e6, friction=quadratic_linear(3e6)))
    nested = hvi.read_tables(model(52, 3e6, friction=LAW))  # with coarser levels
    calls = {
        "path": lambda: followed(small),
        "equilibria": lambda: hvi.equilibria(curved, COMM),
        "lowest": lambda: hvi.equilibria(curved, COMM, lowest=True),
        "solve": lambda: hvi.solve(nested, COMM),
    }
    found = {name: measured(call) for name, call in calls.items()}
    if COMM.rank == 0:
        print(json.dumps(found))


main()
