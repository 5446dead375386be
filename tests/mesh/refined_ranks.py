"""Prints what must not depend on the number of ranks: of refined bodies and of a field prolonged to them."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from domains import BODIES, COMM, ghosts_apart, measure, towards, volume
from petsc4py import PETSc

from hvi_fenicsx.mesh import refinement


def main() -> None:
    """For each body three steps towards the origin."""
    for make in BODIES:
        body = make()
        d = body.dimension
        space = fem.functionspace(body.mesh, ("Lagrange", 1, (d,)))
        field = fem.Function(space)
        field.interpolate(lambda x, d=d: np.array([x[0] ** 2, np.sin(x[1]), x[2] * x[0]])[:d])
        vector = field.x.petsc_vec.copy()
        for step in towards(body, np.zeros(d), 3):
            finer = fem.functionspace(step.domain.mesh, ("Lagrange", 1, (d,)))
            vector = step.transfer.prolongation(finer, space) * vector
            body, space = step.domain, finer
        sizes = [vector.size, vector.norm(), vector.norm(PETSc.NormType.NORM_1), volume(body)]
        lengths = [measure(body, name) for name in sorted(body.sides)]
        apart = max(ghosts_apart(body), ghosts_apart(refinement.uniform(body).domain))
        if COMM.rank == 0:
            print(*sizes, *lengths, apart)


if __name__ == "__main__":
    main()
