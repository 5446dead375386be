"""Prints what must not depend on the number of ranks: of meshes coarser than a file's, and of a prolonged field."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from dolfinx import fem
from domains import COMM, measure
from petsc4py import PETSc

from hvi_fenicsx.mesh import gmsh_file
from hvi_fenicsx.mesh.domain import MeshThresholds as Thresholds
from hvi_fenicsx.mesh.hierarchy import with_hierarchy


def main() -> None:
    """For the file of the first argument."""
    body = with_hierarchy(gmsh_file.read(COMM, Path(sys.argv[1]), 2), Thresholds(hierarchy_from=500, coarsest=100))
    coarser = body.coarser()
    assert coarser is not None
    coarse, transfer = coarser
    spaces = [fem.functionspace(b.mesh, ("Lagrange", 1, (2,))) for b in (body, coarse)]
    field = fem.Function(spaces[1])
    field.interpolate(lambda x: np.array([x[0] ** 2, np.sin(x[1])]))
    up = transfer.prolongation(*spaces) * field.x.petsc_vec
    printed = [coarse.mesh.topology.index_map(2).size_global, up.norm(), up.norm(PETSc.NormType.NORM_1)]
    printed += [measure(coarse, name) for name in sorted(coarse.sides)]
    if COMM.rank == 0:
        print(*printed)


if __name__ == "__main__":
    main()
