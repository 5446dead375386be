"""Prints rows by rank, and products with matrices that are placed on fewer ranks, before and after a change."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from hvi_fenicsx.system.multigrid import PlacedMatrix

COMM = MPI.COMM_WORLD
FINE, COARSE = 14, 6


def dense(rows: int, columns: int) -> Any:
    """Any full matrix."""
    return np.cos(np.arange(rows * columns, dtype=float)).reshape(rows, columns)


def parallel(values: Any) -> PETSc.Mat:
    """The same on all ranks, as PETSc divides it."""
    matrix = PETSc.Mat().createAIJ(values.shape, nnz=values.shape, comm=COMM)
    for row in range(*matrix.getOwnershipRange()):
        matrix.setValues(row, range(values.shape[1]), values[row])
    matrix.assemble()
    return matrix


def product(matrix: PETSc.Mat) -> list[float]:
    """Of the matrix and 0, 1, 2, ..., on all ranks."""
    x, y = matrix.createVecs()
    begin, end = x.getOwnershipRange()
    x.array[:] = np.arange(begin, end)
    matrix.mult(x, y)
    return [float(value) for part in COMM.allgather(y.array_r.tolist()) for value in part]


def main() -> None:
    """Two levels, the finer one on every second rank, the coarser one on the first alone."""
    fine, coarse = parallel(dense(FINE, FINE)), parallel(dense(COARSE, COARSE))
    placed, one = PlacedMatrix(fine, 2), PlacedMatrix(coarse, COMM.size)
    before = product(placed.matrix)
    fine.scale(2.0)
    unchanged = product(placed.matrix)
    placed.update()
    found = {
        "rows": [COMM.allgather(matrix.rows.getLocalSize()) for matrix in (placed, one)],
        "products": [before, unchanged, product(placed.matrix), product(one.matrix)],
        "prolonged": product(one.prolongation(parallel(dense(FINE, COARSE)), placed)),
        "same": PlacedMatrix(coarse, 1).matrix is coarse,
    }
    if COMM.rank == 0:
        print(json.dumps(found))


if __name__ == "__main__":
    main()
