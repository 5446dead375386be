"""Prints, of the block with the cells given as words, what each rank has of it and of the prolongation to it."""

from __future__ import annotations

import json
import sys

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from hvi_fenicsx.mesh import blocks
from hvi_fenicsx.mesh.blocks import GridTransfer


def main() -> None:
    """By rank: its cells, and of its vertices with values from another rank how many cells they lie from a cut."""
    coarser = [n // 2 for n in CELLS]
    fine, coarse = (fem.functionspace(blocks.mesh(COMM, SIZE, n), ("Lagrange", 1, (2,))) for n in (CELLS, coarser))
    columns = GridTransfer(SIZE, CELLS, coarser).prolongation(fine, coarse)
    indptr, found, _ = columns.getValuesCSR()
    first, last = columns.getOwnershipRangesColumn()[COMM.rank : COMM.rank + 2]
    foreign = np.add.reduceat((found < first) | (found >= last), indptr[:-1]) > 0
    points = fine.tabulate_dof_coordinates()[: len(foreign) // 2, :2][foreign[::2]]
    cells = fine.mesh.topology.index_map(2).size_local
    result = COMM.gather([cells, len(points), float(np.max(distances(points), initial=0.0))])
    if COMM.rank == 0:
        print(json.dumps(result))


def distances(points: np.ndarray) -> np.ndarray:
    """Of points from the sides of this rank's part that lie inside of the block, in cells."""
    place = points * CELLS / np.array(SIZE)
    lower, upper = blocks.part_of_rank(CELLS, COMM.size, COMM.rank)
    sides = [(axis, side) for end in (lower, upper) for axis, side in enumerate(end) if 0 < side < CELLS[axis]]
    return np.min([np.abs(place[:, axis] - side) for axis, side in sides], axis=0)


COMM, CELLS, SIZE = MPI.COMM_WORLD, [int(word) for word in sys.argv[1:]], [1.0, 2.0]

if __name__ == "__main__":
    main()
