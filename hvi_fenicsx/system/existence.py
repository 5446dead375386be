"""Does a solution exist? A problem's rigid motions, contact and laws, body by body, handed to :mod:`.rigid`."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from .. import rigid
from ..errors import InputError
from ..problem.contact_surface import Surface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..rigid import (
    ContactCone,
    FixedDirections,
    LoadFactors,
    Resistance,
    RigidBody,
    RigidProblem,
    Solvability,
    analyse,
    combine,
    kernel,
    rigid_fields,
)
from ..typing import Array, Entities, Mask


def solvability(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> Solvability:
    """The state of the scene, from its rigid motions and its load vectors by name. Collective."""
    comm = problem.domain.mesh.comm
    return combine([analyse(comm, body) for body in rigid_problems(problem, forces)])


def load_factors(problem: Problem, forces: Mapping[str, PETSc.Vec], load: str | None = None) -> LoadFactors:
    """Factors of one named load, the others constant, or of the whole load (None). Collective.

    Args:
        problem: as composed. forces: its load vectors by name. load: a name of these, or the part or region that the
            load acts on, where it bears no other one.

    Raises:
        InputError: on all ranks alike: there is no such load.
    """
    name = None if load is None else load_name(list(felt(problem, forces)), load)
    comm = problem.domain.mesh.comm
    return rigid.combine_factors([rigid.load_factors(comm, body, name) for body in rigid_problems(problem, forces)])


def load_name(known: list[str], wanted: str) -> str:
    """The load that is meant: by its full name, or by the part or region that bears it alone.

    Raises:
        InputError: none or several.
    """
    meant = [name for name in known if name == wanted] or [n for n in known if n.rpartition(".")[0] == wanted]
    if len(meant) == 1:
        return meant[0]
    trouble = f"{wanted!r} bears several loads" if meant else f"there is no load {wanted!r}"
    raise InputError(f"{trouble}; there are: {', '.join(known) or 'none'}")


def rigid_problems(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> tuple[RigidProblem, ...]:
    """The data of the existence question, one for each body. Collective."""
    return tuple(of_body(problem, felt(problem, forces), body) for body in problem.bodies)


def moves_with_contact_closed(problem: Problem) -> bool:
    """Whether a rigid motion is left when every contact part is held in its normal direction. Collective."""

    def moves(body: RigidBody) -> bool:
        held = (_along(problem, body, b.surface, b.surface.normals) for b in problem.bounds)
        return kernel(problem.domain.mesh.comm, body, (_prescribed(problem, body), *held)).shape[1] > 0

    return any(moves(body) for body in problem.bodies)


def felt(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> dict[str, PETSc.Vec]:
    """The loads that rigid motions feel: the work of the others on them is rounding only."""
    return {name: force for name, force in forces.items() if name not in problem.bulk.strains}


def of_body(problem: Problem, forces: Mapping[str, PETSc.Vec], body: RigidBody) -> RigidProblem:
    """The data of one body; a law acts on it if it `touches` it. Collective."""
    held = [_along(problem, body, b.surface, b.surface.normals) for b in problem.bounds if _bilateral(b)]
    cones = [_along(problem, body, b.surface, b.surface.normals) for b in problem.bounds if not _bilateral(b)]
    works, force = _works(problem, forces, body)
    return RigidProblem(
        body=body,
        loads=works,
        fixed=(_prescribed(problem, body), *held),
        contact=tuple(ContactCone(cone.points, cone.directions) for cone in cones),
        resistances=tuple(_resistance(problem, body, term) for term in problem.terms if touches(problem, body, term)),
        force=force,
    )


def _bilateral(bounds: Bounds) -> bool:
    return bool(np.all(np.isfinite(bounds.lower) & np.isfinite(bounds.upper)))


def inside(problem: Problem, body: RigidBody, blocks: Entities) -> Mask:
    """Which of these local vertices are the body's."""
    return np.asarray(problem.bodies.labels[blocks] == body.index)


def _along(problem: Problem, body: RigidBody, surface: Surface, directions: Array) -> FixedDirections:
    mine = inside(problem, body, surface.blocks)
    return FixedDirections(np.asarray(surface.points[mine] / problem.scales.length), directions[mine])


def _prescribed(problem: Problem, body: RigidBody) -> FixedDirections:
    d, dofs = problem.scales.dimension, problem.fixed_here
    dofs = dofs[inside(problem, body, dofs // d)]
    points = problem.points[dofs // d]
    return FixedDirections(np.asarray(points / problem.scales.length), np.asarray(np.eye(d)[dofs % d]))


def _works(problem: Problem, forces: Mapping[str, PETSc.Vec], body: RigidBody) -> tuple[dict[str, Array], float]:
    """<g, y> of each load on the rigid basis, and the sum of the absolute nodal forces. Collective."""
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
    points = problem.points
    works, size = {}, 0.0
    for name, force in forces.items():
        nodal = force.array_r.reshape(-1, d)
        loaded = np.flatnonzero(nodal.any(axis=1) & (problem.bodies.labels[: len(nodal)] == body.index))
        fields = rigid_fields(np.asarray(points[loaded] / problem.scales.length), body)
        works[name] = comm.allreduce(np.einsum("vd,vnd->n", nodal[loaded], fields))
        size += comm.allreduce(float(np.abs(nodal[loaded]).sum()))
    return works, size


def touches(problem: Problem, body: RigidBody, term: LawTerm) -> bool:
    """Whether a law acts on the body. Collective."""
    mine = bool(inside(problem, body, term.surface.blocks).any())
    return bool(problem.domain.mesh.comm.allreduce(mine, op=MPI.LOR))


def _resistance(problem: Problem, body: RigidBody, term: LawTerm) -> Resistance:
    surface, law = term.surface, term.exact
    mine = inside(problem, body, surface.blocks)
    points = np.asarray(surface.points[mine] / problem.scales.length)
    return Resistance(
        points=points,
        weights=surface.weights[mine],
        directions=term.directions[mine],
        growth=law.growth,
        peak=law.peak,
        c4=law.c4,
    )
