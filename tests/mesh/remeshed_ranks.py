"""Prints by rank, of a mesh coarser than a file's: part of the cells, distance from the fine part, errors, sizes."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from mpi4py import MPI

from hvi_fenicsx.mesh import coarsening, gmsh_file
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.mesh.hierarchy import with_hierarchy

COMM = MPI.COMM_WORLD


def main() -> None:
    """For the file of the first argument."""
    body = with_hierarchy(gmsh_file.read(COMM, Path(sys.argv[1]), 3), Thresholds(hierarchy_from=500, coarsest=400))
    coarser = body.coarser()
    assert coarser is not None
    coarse = coarser[0]
    centres = [coarsening.owned_corners(b.mesh).reshape(-1, 3).mean(axis=0) for b in (body, coarse)]
    cells = coarse.mesh.topology.index_map(3)
    before, after = coarsening.measures(body), coarsening.measures(coarse)
    printed = (
        cells.size_local / cells.size_global,
        float(np.linalg.norm(centres[0] - centres[1])) / body.length,
        max(abs(after[name] / size - 1) for name, size in before.items()),
        cells.size_global,
        *after.values(),
    )
    for line in COMM.gather(printed) or []:
        print(*line)


if __name__ == "__main__":
    main()
