"""Prints, of a file with two bodies and its coarser mesh, sizes, names, and how well each body's field is prolonged."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from domains import space_on
from mpi4py import MPI

from hvi_fenicsx.mesh import gmsh_file, nodes
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.mesh.hierarchy import with_hierarchy

COMM = MPI.COMM_WORLD


def field(body: Domain, space: fem.FunctionSpace) -> npt.NDArray[Any]:
    """A displacement that is linear in each of the two bodies, another in either, (n, d)."""
    points = nodes.points(space)[:, : body.dimension]
    found = np.zeros_like(points)
    for name, slope in (("lower", 1.0), ("upper", -3.0)):
        chosen = np.unique(space.dofmap.list[body.regions[name]])
        found[chosen] = 2.0 + slope * points[chosen]
    return found


def measured(file: Path, dimension: int) -> dict[str, Any]:
    """What must not depend on the number of ranks."""
    body = with_hierarchy(gmsh_file.read(COMM, file, dimension), Thresholds(hierarchy_from=500, coarsest=100))
    coarser = body.coarser()
    assert coarser is not None
    coarse, transfer = coarser
    fine, under = space_on(body.mesh), space_on(coarse.mesh)
    known = transfer.prolongation(fine, under).createVecRight()
    known.array[:] = field(coarse, under).ravel()[: known.local_size]
    found = (transfer.prolongation(fine, under) * known).array
    error = float(np.max(np.abs(found - field(body, fine).ravel()[: len(found)]), initial=0.0))
    return {
        "error": COMM.allreduce(error, op=MPI.MAX),
        "names": [sorted(body.sides) == sorted(coarse.sides), sorted(body.regions) == sorted(coarse.regions)],
        "vertices": [one.mesh.topology.index_map(0).size_global for one in (body, coarse)],
        "facets": [COMM.allreduce(len(coarse.sides[name])) > 0 for name in sorted(coarse.sides)],
    }


def main() -> None:
    """For the file of the first argument, in as many dimensions as the second says."""
    printed = measured(Path(sys.argv[1]), int(sys.argv[2]))
    if COMM.rank == 0:
        print(json.dumps(printed))


if __name__ == "__main__":
    main()
