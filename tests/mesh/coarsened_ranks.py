"""Prints what must not depend on the number of ranks: of meshes below a file's, and of a field taken up."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from dolfinx import fem
from petsc4py import PETSc
from test_refinement import COMM, measure

from hvi_fenicsx.mesh import coarsening_2d, domain, transfer


def main() -> None:
    """For the file of the first argument."""
    coarsening_2d._WORTHWHILE, coarsening_2d._COARSEST = 500, 100
    body = coarsening_2d.founded(domain.from_file(COMM, Path(sys.argv[1]), 2))
    assert body.origin is not None
    coarse, nesting = body.origin
    spaces = [fem.functionspace(b.mesh, ("Lagrange", 1, (2,))) for b in (body, coarse)]
    field = fem.Function(spaces[1])
    field.interpolate(lambda x: np.array([x[0] ** 2, np.sin(x[1])]))
    up = transfer.prolongation(*spaces, nesting) * field.x.petsc_vec
    told = [coarse.mesh.topology.index_map(2).size_global, up.norm(), up.norm(PETSc.NormType.NORM_1)]
    told += [measure(coarse, name) for name in sorted(coarse.sides)]
    if COMM.rank == 0:
        print(*told)


if __name__ == "__main__":
    main()
