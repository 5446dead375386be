"""Does a solution exist? A problem's rigid motions, contact and laws, handed to :mod:`.rigid`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from .lawterm import LawTerm
from .problem import Bounds, Problem
from .rigid import Body, ContactCone, Fixed, Resistance, RigidProblem, Solvability, analyse, kernel, rigid_fields

Array = npt.NDArray[np.float64]


def body_of(problem: Problem) -> Body:
    """The body, with lengths in units of L."""
    length = problem.scales.length
    return Body(problem.scales.dimension, np.asarray(problem.domain.centre / length), length)


def solvability(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> Solvability:
    """The state of the scene, from its rigid motions and its load vectors by name. Collective."""
    felt = {name: force for name, force in forces.items() if name not in problem.strains}  # theirs is rounding only
    return analyse(problem.domain.mesh.comm, rigid_problem(problem, felt))


def rigid_problem(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> RigidProblem:
    """The data of the existence question. Collective."""
    unilateral = [b for b in problem.bounds if not _bilateral(b)]
    held = [_direction(problem, b.surface.points, b.surface.normals) for b in problem.bounds if _bilateral(b)]
    return RigidProblem(
        body_of(problem),
        _works(problem, forces),
        (_prescribed(problem), *held),
        tuple(ContactCone(_scaled(problem, b.surface.points), b.surface.normals) for b in unilateral),
        tuple(_resistance(problem, term) for term in problem.terms),
    )


def moves_with_contact_closed(problem: Problem) -> bool:
    """Whether a rigid motion is left when every contact part is held in its normal direction. Collective."""
    held = [_direction(problem, b.surface.points, b.surface.normals) for b in problem.bounds]
    basis = kernel(problem.domain.mesh.comm, body_of(problem), (_prescribed(problem), *held))
    return basis.shape[1] > 0


def _bilateral(bounds: Bounds) -> bool:
    return bool(np.all(np.isfinite(bounds.lower) & np.isfinite(bounds.upper)))


def _scaled(problem: Problem, points: Array) -> Array:
    return np.asarray(points / problem.scales.length)


def _direction(problem: Problem, points: Array, directions: Array) -> Fixed:
    return Fixed(_scaled(problem, points), directions)


def _vertices(problem: Problem) -> Array:
    owned = problem.space.dofmap.index_map.size_local
    return _scaled(problem, problem.space.tabulate_dof_coordinates()[:owned])


def _prescribed(problem: Problem) -> Fixed:
    vertices, d = _vertices(problem), problem.scales.dimension
    owned = problem.fixed[problem.fixed < d * len(vertices)]
    return Fixed(vertices[owned // d], np.eye(d)[owned % d])


def _works(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> dict[str, Array]:
    """<g, y> of each load on the rigid basis. Collective."""
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
    fields = rigid_fields(_vertices(problem), body_of(problem))
    return {
        name: comm.allreduce(np.einsum("vd,vnd->n", force.array_r.reshape(-1, d), fields))
        for name, force in forces.items()
    }


def _resistance(problem: Problem, term: LawTerm) -> Resistance:
    surface, law = term.surface, term.exact
    points = _scaled(problem, surface.points)
    return Resistance(points, surface.weights, term.directions, law.growth, law.peak, law.c4)
