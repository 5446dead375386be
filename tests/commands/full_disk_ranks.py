"""What ranks are told where a solution finds no room, then where a field does of which rank 1 has most."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from full_disk import room_for
from mpi4py import MPI

from hvi_fenicsx import InputError, read_scene, solve
from hvi_fenicsx.results import vtk_files

scene, folder = map(Path, sys.argv[1:])
COMM = MPI.COMM_WORLD


def told(room: int, write: Callable[[], None]) -> list[str] | None:
    """What each rank is told where files find so much room. Collective."""
    words = ""
    with room_for(room):
        try:
            write()
        except InputError as error:
            words = str(error)
    return COMM.gather(words)


solution = solve(read_scene(scene))
found = [told(room, lambda: solution.write(folder / "r", pictures=False)) for room in (100, 5_000, 10_000)]
points = np.random.default_rng(0).random((3_000 if COMM.rank else 3, 3))
cells = np.arange(len(points)).reshape(-1, 3)
grid = vtk_files.Grid(points=points, cells=cells, at_points={}, in_cells={}, units={})
found.append(told(2_000, lambda: vtk_files.write(folder / "piece.pvd", COMM, [(0.0, 0, "", grid)])))
if COMM.rank == 0:
    print(json.dumps(found))
