"""A displacement without the travel of bodies that travel far, whose rounding would hide small stresses."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from .problem import Problem
from .thresholds import DEFAULT


def strained(problem: Problem, u: fem.Function, travel: float = DEFAULT.travel) -> fem.Function:
    """A displacement, of each body that travels far without the rigid motion that is nearest to it. Collective.

    Args:
        problem: the bodies.
        u: nondimensional, ghosts updated.
        travel: of a body, relative to its deformation, beyond which it is far.
    """
    d, comm = problem.scales.dimension, problem.domain.mesh.comm
    found = fem.Function(problem.space)
    here = problem.space.dofmap.index_map.size_local
    points, values = np.asarray(problem.points / problem.scales.length), u.x.array.reshape(-1, d).copy()
    for body in problem.bodies:
        mine = problem.bodies.labels == body.index
        fields, owned = problem.bodies.fields(points[mine], np.flatnonzero(mine), body), np.flatnonzero(mine) < here
        gram = comm.allreduce(np.einsum("vnd,vmd->nm", fields[owned], fields[owned]))
        parts = comm.allreduce(np.einsum("vnd,vd->n", fields[owned], values[mine][owned]))
        rigid = np.einsum("n,vnd->vd", np.linalg.solve(gram, parts), fields)
        rest = values[mine] - rigid
        travelled, left = comm.allreduce(np.array([np.sum(rigid[owned] ** 2), np.sum(rest[owned] ** 2)]))
        if travelled > travel**2 * left:
            values[mine] = rest
    found.x.array[:] = values.ravel()
    return found
