"""Does a solution exist? Each body's rigid motions, contact and laws are collected here and judged by :mod:`.rigid`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from petsc4py import PETSc

from .. import rigid
from ..errors import InputError
from ..problem.contact_surface import Surface
from ..problem.interfaces import Interface
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..rigid import (
    JoinedBodies,
    LoadFactors,
    Mode,
    Resistance,
    RigidProblem,
    Solvability,
    analyse,
    combine,
    kernel,
    modes,
    null_space,
    works,
)
from ..runtime.mpi import agree, largest
from ..typing import Array, Entities, Integers, Mask

_T = TypeVar("_T", Solvability, LoadFactors)


def solvability(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> Solvability:
    """Whether a solution exists. Collective.

    Args:
        problem: the problem.
        forces: its load vectors by name.
    """
    comm = problem.comm
    found = combine([analyse(comm, body) for body in rigid_problems(problem, forces)])
    if (obstacles := _with_obstacles(problem, forces)) is not None:
        known = [_of_body(body, analyse(comm, body), "direction", "critical") for body in obstacles]
        found = replace(combine(known), kernel=found.kernel, loose=found.loose, free=found.free, paper=found.paper)
    return replace(found, direction=named(problem, found.direction))


def load_factors(problem: Problem, forces: Mapping[str, PETSc.Vec], *loads: str) -> LoadFactors:
    """Between which factors of some loads together the body is held, the other loads constant. Collective.

    Args:
        problem: the problem.
        forces: its load vectors by name.
        loads: names of loads, or of the parts or regions that they act on alone; none for the whole load.

    Raises:
        InputError: on all ranks alike: there is no such load.
    """
    comm, bodies = problem.comm, _with_obstacles(problem, forces) or rigid_problems(problem, forces)
    known = list(dict.fromkeys(n for body in bodies for n in body.loads))
    names = [load_name(known, load) for load in loads]
    each = [_of_body(body, rigid.load_factors(comm, body, *names), "mode", "peak_mode") for body in bodies]
    found = rigid.combine_factors(each)
    mode, peak = (named(problem, limiting) for limiting in (found.mode, found.peak_mode))
    return replace(found, mode=mode, peak_mode=peak)


def load_name(known: list[str], wanted: str) -> str:
    """The full name of a load.

    Args:
        known: the full names of all loads.
        wanted: a full name, or that of a part or region on which one load acts.

    Raises:
        InputError: there is no such load, or more than one.
    """
    meant = [name for name in known if name == wanted] or [n for n in known if n.rpartition(".")[0] == wanted]
    if len(meant) == 1:
        return meant[0]
    trouble = f"{wanted!r} bears several loads" if meant else f"there is no load {wanted!r}"
    raise InputError(f"{trouble}; there are: {', '.join(known) or 'none'}")


def rigid_problems(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> tuple[RigidProblem, ...]:
    """The data of the existence question, body by body. Collective.

    Args:
        problem: the problem.
        forces: its load vectors by name.
    """
    loads = loads_of_rigid_motions(problem, forces)
    return tuple(rigid_problem(problem, loads, body) for body in problem.bodies)


def _with_obstacles(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> tuple[RigidProblem, ...] | None:
    """The data with obstacles that forces press; None without one, or if one touches two bodies. Collective."""
    whole = rigid_problems(problem, forces)
    if all(b.force is None for b in problem.bounds):
        return None
    touched = [
        {b.force.name: b.force for b in problem.bounds if b.force is not None and acts_on(problem, one.body, b.surface)}
        for one in whole
    ]
    names = [name for one in touched for name in one]
    if len(set(names)) < len(names):
        return None
    found = [
        rigid.pressed(one, {name: f.force for name, f in here.items()}, _ways(problem, one.body, list(here)))
        for one, here in zip(whole, touched, strict=True)
    ]
    return tuple(replace(one, loads={n: np.zeros(one.body.motions) for n in names} | dict(one.loads)) for one in found)


def _ways(problem: Problem, body: JoinedBodies, names: Sequence[str]) -> list[Array]:
    """What a unit of each obstacle's way adds to the rows of each contact of a body, (m, obstacles)."""
    found: list[Array] = []
    for bounds in (b for b in problem.bounds if not _bilateral(b)):
        mine = inside(problem, body, bounds.surface.blocks)
        ways = np.zeros((np.count_nonzero(mine), len(names)))
        if (force := bounds.force) is not None:
            ways[:, names.index(force.name)] = -force.rate[mine]
        found.append(ways)
    return found


def _of_body(problem: RigidProblem, found: _T, *motions: str) -> _T:
    """A verdict, or load factors, whose motions (by these names) are those of the body."""
    own: dict[str, Any] = {name: rigid.without_obstacles(problem, getattr(found, name)) for name in motions}
    return replace(found, **own)


def motions(problem: Problem, *, contact_closed: bool, without: Sequence[Mode] = ()) -> list[Mode]:
    """The rigid motions that prescribed displacements leave. Collective.

    Args:
        problem: the problem.
        contact_closed: only those that do not move the contact parts in their normal direction.
        without: motions to which the others are orthogonal, as coefficients.
    """
    found: list[Mode] = []
    for body in problem.bodies:
        held = [normals(problem, body, b.surface) for b in problem.bounds] if contact_closed else []
        basis = kernel(problem.comm, body, (prescribed(problem, body), *held))
        left_out = np.array([mode.coefficients for mode in without if mode.body == body.index])
        if len(left_out):
            basis = basis @ null_space(left_out @ basis)
        found += modes(basis, body)
    return found


def loads_of_rigid_motions(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> dict[str, PETSc.Vec]:
    """The loads that do work on rigid motions; the work of a given strain is rounding only.

    Args:
        problem: the problem.
        forces: its load vectors by name.
    """
    return {name: force for name, force in forces.items() if name not in problem.bulk.strains}


def rigid_problem(problem: Problem, forces: Mapping[str, PETSc.Vec], body: JoinedBodies) -> RigidProblem:
    """The data of the existence question of one body. Collective.

    Args:
        problem: the problem.
        forces: the loads of rigid motions by name.
        body: the body.
    """
    bounded = [(_bilateral(b), normals(problem, body, b.surface)) for b in problem.bounds]  # all ranks, in one order
    loads, force = _works(problem, forces, body)
    return RigidProblem(
        body=body,
        loads=loads,
        fixed=(prescribed(problem, body), *(rows for bilateral, rows in bounded if bilateral)),
        contact=tuple(rows for bilateral, rows in bounded if not bilateral),
        resistances=tuple(
            _resistance(problem, body, term) for term in problem.terms if acts_on(problem, body, term.surface)
        ),
        force=force,
    )


def _bilateral(bounds: Bounds) -> bool:
    return bool(np.all(np.isfinite(bounds.lower) & np.isfinite(bounds.upper)))


def inside(problem: Problem, body: JoinedBodies, blocks: Entities) -> Mask:
    """Which vertices belong to a body, (n,).

    Args:
        problem: the problem.
        body: the body.
        blocks: local vertices, (n,).
    """
    return problem.bodies.labels[blocks] == body.index


def normals(problem: Problem, body: JoinedBodies, surface: Surface, closed: Mask | None = None) -> Array:
    """The work of a surface's normals at the body's vertices in its rigid motions, (m, motions).

    Args:
        problem: the problem.
        body: the body.
        surface: where.
        closed: at which of its vertices; None: at all.
    """
    mine = inside(problem, body, surface.blocks) & (True if closed is None else closed)
    return works(surface.normals[mine], problem.motions_at(surface.blocks[mine], body))


def prescribed(problem: Problem, body: JoinedBodies) -> Array:
    """The prescribed components of the body's rigid motions, (m, motions).

    Args:
        problem: the problem.
        body: the body.
    """
    d, dofs = problem.dimension, problem.fixed_here
    dofs = dofs[inside(problem, body, dofs // d)]
    return works(np.eye(d)[dofs % d], problem.motions_at(dofs // d, body))


def _works(problem: Problem, forces: Mapping[str, PETSc.Vec], body: JoinedBodies) -> tuple[dict[str, Array], float]:
    """<g, y> of each load on the rigid basis, and the sum of the absolute nodal forces. Collective."""
    comm, d = problem.comm, problem.dimension
    found, size = {}, 0.0
    for name, force in forces.items():
        nodal = force.array_r.reshape(-1, d)
        loaded = np.flatnonzero(nodal.any(axis=1) & (problem.bodies.labels[: len(nodal)] == body.index))
        fields = problem.bodies.fields(problem.points[loaded] / problem.scales.length, loaded, body)
        found[name] = comm.allreduce(np.einsum("vd,vnd->n", nodal[loaded], fields))
        size += comm.allreduce(float(np.abs(nodal[loaded]).sum()))
    return found, size


def acts_on(problem: Problem, body: JoinedBodies, surface: Surface) -> bool:
    """Whether a part of Γc has vertices of a body. Collective.

    Args:
        problem: the problem.
        body: the body.
        surface: the part.
    """
    return any(agree(problem.comm, inside(problem, body, surface.blocks).any()))


def _resistance(problem: Problem, body: JoinedBodies, term: LawTerm) -> Resistance:
    surface, law, mixity = term.surface, term.exact, term.mixity
    least, greatest = (1.0, 1.0) if mixity is None else sorted((1.0, mixity.energy_ratio))
    mine = inside(problem, body, surface.blocks)
    return Resistance(
        fields=problem.motions_at(surface.blocks[mine], body),
        weights=term.weights[mine],
        directions=term.directions[mine],
        growth=law.growth.times(least),
        peak=law.peak.times(greatest),
        c4=law.c4,
        length=term.length,
    )


STILL = 1e-6
"""A part of the largest motion that is none."""


def named(problem: Problem, mode: Mode | None) -> Mode | None:
    """A signed motion whose name also says which body leaves which one, and how. Collective.

    Args:
        problem: whose bodies move.
        mode: the motion.
    """
    if mode is None:
        return None
    names, left = [body.name for body in problem.bodies.single()], dict[str, list[str]]()
    moved = np.linalg.norm(problem.bodies.motion(problem.points / problem.scales.length, mode), axis=1)
    numbers = problem.bodies.number_at(np.arange(len(moved)))
    speeds = [_most(problem, moved[numbers == number]) for number in range(len(names))]
    still = STILL * max(speeds)
    moving = [number for number, speed in enumerate(speeds) if speed > still]
    for interface in problem.interfaces:
        if (way := _way(problem, interface, mode, still)) is not None:
            first, second = (_body(problem, side.nodes) for side in (interface.first, interface.second))
            who, other = (first, second) if first in moving else (second, first)
            left.setdefault(f"{'it' if moving == [who] else names[who]} {way}", []).append(names[other])
    words = ", ".join(f"{way} {' and '.join(dict.fromkeys(others))}" for way, others in left.items())
    return replace(mode, name=f"{mode.name}: {words}") if words else mode


def _way(problem: Problem, interface: Interface, mode: Mode, still: float) -> str | None:
    """How the first side moves relative to the second; None where it does not. Collective."""
    blocks = interface.surface.blocks
    fields = problem.motions_at(blocks, problem.bodies.bodies[mode.body])
    relative = np.einsum("n,mnd->md", mode.coefficients, fields)
    opening = -np.sum(relative * interface.surface.normals, axis=1)
    if _most(problem, np.linalg.norm(relative, axis=1)) <= still:
        return None
    if _most(problem, opening) <= still:
        return "slides off"
    return "lifts off" if -_most(problem, -opening) > still else "comes off"


def _body(problem: Problem, nodes: Integers) -> int:
    """The number of the body of a side. Collective."""
    start, end = problem.space.dofmap.index_map.local_range
    here = nodes[(nodes >= start) & (nodes < end)] - start
    found = agree(problem.comm, problem.bodies.number_at(here[:1]))
    return int(np.concatenate(found)[0])


def _most(problem: Problem, values: Array) -> float:
    """The largest value of all ranks. Collective."""
    return largest(problem.comm, float(values.max(initial=-np.inf)))
