"""The near-null space of a stiffness: the rigid motions, which algebraic multigrid must keep.

``PETSc.NullSpace.createRigidBody`` spans the same space and takes as many iterations, but it knows no local frames.
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ..problem.bodies import whole
from ..problem.problem import Problem
from ..problem.vectors import new_vector, null_space, turn
from ..rigid import rigid_fields


def rigid_modes(problem: Problem, rotation: PETSc.Mat | None) -> PETSc.NullSpace:
    """All rigid motions of the body without supports, orthonormal, in the components of the unknowns. Collective.

    Args:
        problem: the problem.
        rotation: Q with u = Q û for unknowns û in local components; None where there are none.
    """
    body, vectors = whole(problem.domain), []
    owned = problem.points[: problem.space.dofmap.index_map.size_local]
    fields = rigid_fields(np.asarray(owned / problem.scales.length), body)
    for number in range(body.motions):
        vector = new_vector(problem.space)
        vector.array[:] = problem.relative(fields[:, number].ravel())[: vector.local_size]
        turn(vector, rotation)
        vectors.append(vector)
    return null_space(vectors)
