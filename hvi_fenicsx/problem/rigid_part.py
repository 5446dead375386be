"""Elastic forces by cell, and the rigid part of a displacement, which strains nothing.

A body may travel 1e6 times as far as it deforms. The rounding of its stresses then is that of its travel, and its
elastic forces no longer balance each other. Those of the rest do, however far the body is from its place. Of a body
that travels less nothing is taken off, since to take it off rounds too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..typing import Array, Integers
from .problem import Problem
from .scaling import DEFAULT


@dataclass(frozen=True, kw_only=True)
class _BodyMotions:
    """The rigid motions of one body.

    Attributes:
        places: of its values among all local ones, those that this rank owns first, (n,).
        owned: how many these are.
        values: of the motions, orthonormal over all ranks, (m, n).
    """

    places: Integers
    owned: int
    values: Array


def elastic_forces(problem: Problem, u: fem.Function) -> Array:
    """a(u, v) of the test functions by cells, (blocks, d): strains first, travel leaves them its rounding. Collective.

    Args:
        problem: the bodies.
        u: nondimensional, ghosts updated.
    """
    bulk, strains = problem.bulk, strained(problem, u)
    if strains is u or bulk.foundation is None:
        return bulk.force(strains)
    travel = fem.Function(problem.space)
    travel.x.array[:] = u.x.array - strains.x.array
    return bulk.force(strains) + bulk.foundation_force(travel)


def strained(problem: Problem, u: fem.Function, travel: float = DEFAULT.travel) -> fem.Function:
    """A displacement, of each body that travels far without the rigid motion that is nearest to it. Collective.

    Args:
        problem: the bodies.
        u: nondimensional, ghosts updated.
        travel: of a body, relative to its deformation, beyond which it is far.

    Returns:
        u itself where none is.
    """
    comm, found = problem.domain.mesh.comm, u
    for body in problem.once("rigid motions of displacements", None, lambda: _motions(problem)):
        values = u.x.array[body.places]
        with np.errstate(invalid="ignore"):  # what is no number is told by who judges it
            share = comm.allreduce(body.values[:, : body.owned] @ values[: body.owned])
            rest = values - share @ body.values
        if share @ share > travel**2 * comm.allreduce(rest[: body.owned] @ rest[: body.owned]):
            found = u.copy() if found is u else found
            found.x.array[body.places] = rest
    return found


def _motions(problem: Problem) -> list[_BodyMotions]:
    """All rigid motions of all bodies. Collective."""
    points, d = np.asarray(problem.points / problem.scales.length), problem.scales.dimension
    here, every = problem.space.dofmap.index_map.size_local, list[_BodyMotions]()
    for body in problem.bodies:
        blocks = np.flatnonzero(problem.bodies.labels == body.index)
        fields = problem.bodies.fields(points[blocks], blocks, body).transpose(1, 0, 2)
        places = (blocks[:, None] * d + np.arange(d)).ravel()
        values, owned = fields.reshape(len(fields), -1), d * int(np.count_nonzero(blocks < here))
        factor = np.linalg.cholesky(problem.domain.mesh.comm.allreduce(values[:, :owned] @ values[:, :owned].T))
        every.append(_BodyMotions(places=places, owned=owned, values=np.asarray(np.linalg.solve(factor, values))))
    return every
