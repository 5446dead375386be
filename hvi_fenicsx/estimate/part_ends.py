"""Parts with `where` that end within a facet: the mesh counts this facet as a whole, or not at all.

A load that is too much there, or too little, is a load of its own, and so is the traction of a law that gives way. The
displacement that they cause is found in u_h's space, and counts in the cells at these facets: smaller ones make it
smaller, wherever the body gives way. What holds the body firmly is singular at its end.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem, la

from ..certify import placed_forces
from ..certify.certificate import Examination
from ..certify.contact_state import ContactState
from ..effects import SideMoments
from ..effects.base import SurfaceLoad
from ..mesh import facets as facet_sizes
from ..mesh import nodes
from ..mesh.boundary_part import Inequalities
from ..problem import boundary_parts, references, spaces
from ..problem.problem import Problem
from ..runtime.mpi import total
from ..typing import Array, Entities, Mask
from .bubbles import gathered, summed
from .data_errors import FacetModes, facet_modes
from .dual_norm import DualNorm


def energies(on: FacetModes, missing: Array, tractions: Array) -> Array:
    """η_K² of facets on which a firm hold ends elsewhere than in the scene, (f,).

    Args:
        on: the facets.
        missing: 1 at the sample points that the mesh does not hold, -1 at those that it holds too much, (f, q).
        tractions: the mean ones over the facets at the end, (f, d).
    """
    moved = np.sum(on.weights * missing, axis=1)
    costs = np.pi**2 / 4.0 * np.abs(moved) * on.facets.areas * np.sum(tractions**2 * on.compliance, axis=1)
    return np.asarray(costs * np.where(moved > 0.0, _of_lacking(on.facets.degree, np.abs(moved)), 1.0))


def _of_lacking(degree: int, share: Array) -> Array:
    """What the cost of moving the end is multiplied by where u_h is not held on a share of the facet, (f,).

    u_h lies on the scene's own end too late, and what it costs is not orthogonal to what the mesh costs: both
    together have the square of the latter and 2 ∫ p·u_h ds less the cost, p being the traction of the true solution.
    Had u_h the true opening √r, the integral would be the cost; it has that which interpolates it from node to node.
    """
    if degree == 1:
        work = 4.0 / 3.0 * np.sqrt(share)
    else:
        work = 4.0 / 3.0 * (2.0**1.5 - 1.0) * np.sqrt(share) - 16.0 / 15.0 * (2.0**1.5 - 2.0) * share**1.5
    return np.asarray(np.maximum(4.0 / np.pi * work - 1.0, 0.0))


def firmness(on: FacetModes, rates: Array) -> Array:
    """How far a law holds as a support does, from 0 to 1 along each axis, (f, d).

    Args:
        on: the facets.
        rates: by which its tractions rise with the displacement, means over the facets at the end, (f, d).
    """
    beside = rates * on.compliance
    return np.asarray(beside / (1.0 + beside))


def mean(on: FacetModes, ends: Array) -> Array:
    """The mean over those corners of each facet at which a part ends, (f, d).

    Args:
        on: the facets.
        ends: as :func:`at_ends` gives them, local blocks (n, d).
    """
    values = ends[on.facets.corners]
    count = np.any(values, axis=2).sum(axis=1)
    return np.asarray(values.sum(axis=1) / np.maximum(count, 1)[:, None])


def yielding(problem: Problem, part: str, states: Sequence[ContactState]) -> tuple[Array, Array]:
    """What laws of a part put on the body where they are off their kinks, and how fast it rises; owned blocks (n, d).

    Args:
        problem: what was solved.
        part: its name.
        states: of the parts of Γc.

    Returns:
        Nodal forces, and those for a unit of displacement along each axis.
    """
    forces = np.zeros((problem.space.dofmap.index_map.size_local, problem.scales.dimension))
    rates = np.zeros_like(forces)
    for state in (state for state in states if state.surface.part == part):
        for law in state.laws:
            weights = np.where(law.on_convex_kink(), 0.0, state.surface.weights)
            vectors = np.einsum("mk,mkd->md", law.carried, law.term.directions)
            np.subtract.at(forces, state.surface.blocks, weights[:, None] * vectors)
            rising = law.term.law.convex.second(law.argument) - law.term.law.concave.second(law.argument)
            rising = weights * law.term.multiplier * np.maximum(rising, 0.0) / law.term.stretch
            np.add.at(rates, state.surface.blocks, rising[:, None] * np.sum(law.term.directions**2, axis=1))
    return forces, rates


def at_ends(problem: Problem, part: Entities, beyond: Entities, forces: Array, reaction: Array) -> Array:
    """The mean tractions over the facets of a part that meet at a vertex of its end, local blocks (n, d). Collective.

    What holds the body beyond the end as well, along the same axis, is no end and is taken off.

    Args:
        problem: what was solved.
        part: the local facets of the part.
        beyond: those of the same sides that are not in it.
        forces: on the part, owned blocks (n, d).
        reaction: of everything, owned blocks (n, d).
    """
    here, there = (_areas(problem, facets) for facets in (part, beyond))
    own = _means(problem, part, forces, here, here > 0.0)
    other = _means(problem, beyond, reaction, there, here == 0.0)
    left = np.where(own * other > 0.0, np.sign(own) * np.maximum(np.abs(own) - np.abs(other), 0.0), own)
    return np.where(((here > 0.0) & (there > 0.0))[:, None], left, 0.0)


def _areas(problem: Problem, facets: Entities) -> Array:
    """The lumped areas of facets at the local nodes, nondimensional, (n,). Collective."""
    found = la.vector(problem.space.dofmap.index_map)
    owned = references.lumped(problem, facets) / problem.scales.length ** (problem.scales.dimension - 1)
    found.array[: len(owned)] = owned
    found.scatter_forward()
    return np.asarray(found.array, dtype=np.float64)


def _means(problem: Problem, facets: Entities, forces: Array, areas: Array, counted: Mask) -> Array:
    """The mean traction over the facets that meet at a vertex, of the nodes that count, local blocks (n, d).

    Collective.
    """
    space, d, owned = problem.space, problem.scales.dimension, len(forces)
    field, count = fem.Function(space), la.vector(space.dofmap.index_map)
    values = field.x.array.reshape(-1, d)
    values[:owned] = forces / np.where(areas > 0.0, areas, np.inf)[:owned, None]
    field.x.scatter_forward()
    on = nodes.facet_nodes(space, facet_sizes.owned(problem.domain.mesh, facets))
    weights = spaces.facet_weights(space, np.ones(len(on))) * counted[on]
    whole = weights.sum(axis=1)
    means = np.einsum("fn,fnd->fd", weights, values[on]) / np.where(whole > 0.0, whole, np.inf)[:, None]
    values[:] = 0.0
    for corner in on[:, :d].T:
        np.add.at(values, corner, means)
        np.add.at(count.array, corner, 1.0)
    for vector in (field.x, count):
        vector.scatter_reverse(la.InsertMode.add)
        vector.scatter_forward()
    return np.asarray(values / np.maximum(count.array, 1.0)[:, None])


@dataclass(frozen=True)
class _Piece:
    """Facets of a side (f of them) that a part has as a whole, or not at all, with q sample points in each.

    Attributes:
        on: the facets.
        share: 1 at the sample points that are in the part, else 0, (f, q).
        meshed: the same as the mesh has it, (f, q).
    """

    on: FacetModes
    share: Array
    meshed: Array

    @property
    def missing(self) -> Array:
        """1 at the sample points where the mesh lacks the part, -1 beyond its end, (f, q)."""
        return np.asarray(self.share - self.meshed)

    @property
    def sizes(self) -> Array:
        """What the sample points stand for, over L^(d-1), (f, q)."""
        return np.asarray(self.on.facets.areas[:, None] * self.on.weights)


@dataclass(frozen=True)
class _Part:
    """A part with `where`.

    Attributes:
        name: of the part.
        facets: its local facets.
        beyond: the other local facets of its sides.
        pieces: both, sampled.
    """

    name: str
    facets: Entities
    beyond: Entities
    pieces: Sequence[_Piece]


_Lacking = tuple[_Piece, Array]
"""Facets, and the tractions that the mesh lacks at their sample points, nondimensional, (f, q, d)."""


def squares(
    problem: Problem, bubbles: fem.FunctionSpace, u: fem.Function, examination: Examination, inverse: DualNorm
) -> Array:
    """η_K² of the owned cells that the ends of parts add. Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        u: the solution, ghosts updated.
        examination: of the same u.
        inverse: of the system's stiffness.
    """
    cells = np.zeros(problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local)
    parts = list(_parts(problem, bubbles))
    if not parts:
        return cells
    holding = placed_forces.reactions(problem, u, examination.forces, examination.states)
    lacking: list[_Lacking] = []
    for part in parts:
        lacking += [*_loads(problem, part), *_sums(problem, part)]
        if part.name in holding:
            held = holding[part.name].at(np.arange(len(examination.forces.reaction), dtype=np.int32))
            lacking += _held(problem, part, held, examination, cells)
    return np.asarray(cells + _of_loads(problem, inverse, lacking))


def _held(problem: Problem, part: _Part, forces: Array, examination: Examination, cells: Array) -> list[_Lacking]:
    """Add η_K² of what holds the body firmly on a part; the tractions that the mesh lacks of what gives way there.

    Collective.

    Args:
        problem: what was solved.
        part: which one.
        forces: all that holds the body there, owned blocks (n, d).
        examination: of the solution.
        cells: η_K², changed in place.
    """
    giving, rates = yielding(problem, part.name, examination.states)
    reaction = examination.forces.reaction
    firm, soft, rising = (
        at_ends(problem, part.facets, part.beyond, *one)
        for one in ((forces - giving, reaction), (giving, reaction), (rates, np.zeros_like(rates)))
    )
    lacking: list[_Lacking] = []
    for piece in part.pieces:
        on, lost = piece.on, mean(piece.on, soft)
        stiff = firmness(on, mean(on, rising))
        for tractions in (mean(on, firm), np.sqrt(stiff) * lost):
            np.add.at(cells, on.facets.cells, energies(on, piece.missing, tractions))
        lacking.append((piece, np.asarray(piece.missing[:, :, None] * ((1.0 - stiff) * lost)[:, None])))
    return lacking


def _parts(problem: Problem, bubbles: fem.FunctionSpace) -> Iterator[_Part]:
    """The parts with `where`. Collective."""
    for name, piece in problem.pieces.items():
        if piece.where is not None:
            facets = problem.part_facets[name]
            beyond = np.setdiff1d(problem.domain.facets(piece.on), facets).astype(np.int32)
            on = [facet_modes(problem, bubbles, some) for some in (facets, beyond)]
            shares = [_share(one, piece.where) for one in on]
            meshed = np.ones_like(shares[0]), np.zeros_like(shares[1])
            yield _Part(name, facets, beyond, [_Piece(*one) for one in zip(on, shares, meshed, strict=True)])


def _share(on: FacetModes, where: Inequalities) -> Array:
    return where.at(on.points.reshape(-1, 3)).reshape(on.points.shape[:2]).astype(np.float64)


def _loads(problem: Problem, part: _Part) -> Iterator[_Lacking]:
    """The tractions that the mesh lacks of the loads on a part."""
    loads = (effect.surface_load() for where, effect, _ in problem.contributions if where == part.name)
    for load, piece in itertools.product((load for load in loads if load is not None), part.pieces):
        there = _tractions(problem, piece.on, load, piece.missing != 0.0)
        yield piece, np.asarray(piece.missing[:, :, None] * there)


def _sums(problem: Problem, part: _Part) -> Iterator[_Lacking]:
    """The same of sums over a part: spread over more than it, they are less everywhere. Collective."""
    spread = [effect for where, effect, _ in problem.contributions if where == part.name and effect.is_sum]
    if not spread:
        return
    true, meshed = _moments(problem, part, "share"), _moments(problem, part, "meshed")
    for effect in spread:
        for piece in part.pieces:
            at, shape = piece.on.points.reshape(-1, 3), (*piece.share.shape, problem.scales.dimension)
            wanted, given = (effect.spread_at(moments, at).reshape(shape) for moments in (true, meshed))
            lacking = piece.share[:, :, None] * wanted - piece.meshed[:, :, None] * given
            yield piece, np.asarray(lacking / problem.scales.stress)


def _moments(problem: Problem, part: _Part, which: str) -> SideMoments:
    """Area, centroid and second moments of the part, in truth (``share``) or as ``meshed``. Collective."""
    d = problem.scales.dimension
    points = np.concatenate([piece.on.points.reshape(-1, 3)[:, :d] for piece in part.pieces])
    sizes = np.concatenate([(piece.sizes * getattr(piece, which)).ravel() for piece in part.pieces])
    return boundary_parts.of_points(problem.domain.mesh.comm, points, sizes * problem.scales.length ** (d - 1))


def _of_loads(problem: Problem, inverse: DualNorm, lacking: Sequence[_Lacking]) -> Array:
    """η_K² of the owned cells that lacking tractions add. Collective."""
    d = problem.scales.dimension
    cells = np.zeros(problem.domain.mesh.topology.index_map(d).size_local)
    forces: list[tuple[Entities, Array]] = []
    for piece, tractions in lacking:
        facets = piece.on.facets
        functions = spaces.simplex_functions(facets.degree, piece.on.barycentric, spaces.edge_share(problem.space))
        weighted = piece.sizes[:, :, None] * tractions
        forces.append((facets.nodes.ravel(), np.einsum("fqd,qn->fnd", weighted, functions).reshape(-1, d)))
        np.add.at(cells, facets.cells, np.sum(np.abs(weighted), axis=(1, 2)) ** 2)
    whole = total(problem.domain.mesh.comm, float(cells.sum()))
    if whole == 0.0:
        return cells
    missing = gathered(problem.space, summed(forces, d)).everywhere(problem.space.dofmap.index_map.size_local)
    energy = problem.bulk.energy_by_cell(inverse.solve(problem.combined(missing))[0])
    return np.asarray(total(problem.domain.mesh.comm, float(energy.sum())) * cells / whole)


def _tractions(problem: Problem, on: FacetModes, load: SurfaceLoad, where: Mask) -> Array:
    """A load, as far as it is known between nodes, at chosen ones of the sample points, nondimensional, (f, q, d)."""
    found = np.zeros((*where.shape, problem.scales.dimension))
    for axis, value in enumerate(load.components):
        if value.everywhere:
            found[where, axis] = value.at(on.points[where])
    if load.pressure is not None and load.pressure.everywhere:
        normals = np.broadcast_to(_outward(problem, on)[:, None], found.shape)
        found[where] -= load.pressure.at(on.points[where])[:, None] * normals[where]
    return np.asarray(found / problem.scales.stress)


def _outward(problem: Problem, on: FacetModes) -> Array:
    """The outward unit normals of facets, (f, d)."""
    corners, d = on.corners[:, :, : problem.scales.dimension], problem.scales.dimension
    sides = corners[:, 1:] - corners[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1]) if d == 3 else sides[:, 0, ::-1] * [1.0, -1.0]
    cells = problem.positions[problem.space.dofmap.list[on.facets.cells]].mean(axis=1)[:, :d]
    inward = np.sum((cells - corners.mean(axis=1)) * normals, axis=1) > 0.0
    normals = np.where(inward[:, None], -normals, normals)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))
