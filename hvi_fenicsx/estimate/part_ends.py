"""Parts that end within a facet: what the mesh makes of loads, laws and supports there.

A facet belongs to a part with `where` as a whole, or not at all: a load that is too much there, or too little, is a
load of its own, and so is the traction of a law that gives way. The displacement that they cause is found in u_h's
space, and counts in the cells at these facets: smaller ones make it smaller, wherever the body gives way. What holds
the body firmly is singular at its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem, la

from ..certify import placed_forces
from ..certify.certificate import Examination
from ..certify.contact_state import ContactState
from ..mesh import facets as facet_sizes
from ..mesh import nodes
from ..problem import domain_forms, references, spaces
from ..problem.facets import function_integrals, outward
from ..problem.problem import Problem
from ..runtime.mpi import total
from ..typing import Array, Entities, Mask
from .bubbles import collected
from .data_errors import FacetModes, facet_modes
from .dual_norm import DualNorm


def _energies(part: _Part, squares: Array) -> Array:
    """η_K² of facets on which a firm hold ends elsewhere than in the scene, (f,).

    Args:
        part: that ends.
        squares: of the mean tractions over the facets at the end, (f, d).
    """
    on, moved = part.on, np.sum(part.on.weights * part.missing, axis=1)
    costs = np.pi**2 / 4.0 * np.abs(moved) * on.facets.areas * np.sum(squares * on.compliance, axis=1)
    return costs * np.where(moved > 0.0, _of_lacking(on.facets.degree, np.abs(moved)), 1.0)


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
    return np.maximum(4.0 / np.pi * work - 1.0, 0.0)


def _mean(on: FacetModes, ends: Array) -> Array:
    """The mean over those corners of each facet at which a part ends, of local blocks (n, d); (f, d)."""
    values = ends[on.facets.nodes[:, : on.barycentric.shape[1]]]
    count = np.any(values, axis=2).sum(axis=1)
    return values.sum(axis=1) / np.maximum(count, 1)[:, None]


def _yielding(problem: Problem, part: str, states: Sequence[ContactState]) -> tuple[Array, Array]:
    """What laws of a part put on the body off their kinks, and how fast that rises; owned blocks (n, d)."""
    forces = np.zeros((problem.space.dofmap.index_map.size_local, problem.dimension))
    rates = np.zeros_like(forces)
    for state in (state for state in states if state.surface.part == part):
        for law in state.laws:
            weights = np.where(law.on_convex_kink(), 0.0, state.surface.weights)
            vectors = np.einsum("mk,mkd->md", law.carried, law.term.directions)
            np.subtract.at(forces, state.surface.blocks, weights[:, None] * vectors)
            rising = np.maximum(law.term.law.derivatives(law.argument)[1], 0.0)
            rising *= weights * law.term.multiplier / law.term.stretch
            np.add.at(rates, state.surface.blocks, rising[:, None] * np.sum(law.term.directions**2, axis=1))
    return forces, rates


def _at_ends(problem: Problem, part: _Part, forces: Array, reaction: Array) -> Array:
    """The mean tractions over the facets of a part that meet at a vertex of its end, local blocks (n, d). Collective.

    What holds the body beyond the end as well, along the same axis, is no end and is taken off.

    Args:
        problem: what was solved.
        part: that ends.
        forces: on the part, owned blocks (n, d).
        reaction: of everything, owned blocks (n, d).
    """
    here, there = (_areas(problem, facets) for facets in (part.facets, part.beyond))
    own = _means(problem, part.facets, forces, here, here > 0.0)
    other = _means(problem, part.beyond, reaction, there, here == 0.0)
    left = np.where(own * other > 0.0, np.sign(own) * np.maximum(np.abs(own) - np.abs(other), 0.0), own)
    return np.where(((here > 0.0) & (there > 0.0))[:, None], left, 0.0)


def _areas(problem: Problem, facets: Entities) -> Array:
    """The lumped areas of facets at the local nodes, nondimensional, (n,). Collective."""
    found = la.vector(problem.space.dofmap.index_map)
    owned = references.lumped(problem, facets) / problem.scales.length ** (problem.dimension - 1)
    found.array[: len(owned)] = owned
    found.scatter_forward()
    return found.array


def _means(problem: Problem, facets: Entities, forces: Array, areas: Array, counted: Mask) -> Array:
    """The mean traction over the facets that meet at a vertex, of the nodes that count, local blocks (n, d).

    Collective.
    """
    space, d, owned = problem.space, problem.dimension, len(forces)
    field, count = fem.Function(space), la.vector(space.dofmap.index_map)
    values = field.x.array.reshape(-1, d)
    values[:owned] = forces / np.where(areas > 0.0, areas, np.inf)[:owned, None]
    field.x.scatter_forward()
    owned_facets = facet_sizes.owned(problem.domain.mesh, facets)
    on = nodes.facet_nodes(space, owned_facets)
    weights = function_integrals(space, owned_facets) * counted[on]
    whole = weights.sum(axis=1)
    means = np.einsum("fn,fnd->fd", weights, values[on]) / np.where(whole > 0.0, whole, np.inf)[:, None]
    values[:] = 0.0
    for corner in on[:, :d].T:
        np.add.at(values, corner, means)
        np.add.at(count.array, corner, 1.0)
    for vector in (field.x, count):
        vector.scatter_reverse(la.InsertMode.add)
        vector.scatter_forward()
    return values / np.maximum(count.array, 1.0)[:, None]


@dataclass(frozen=True)
class _Part:
    """A part with `where`, and the facets of its sides (f of them), each of which the mesh counts whole or not at all.

    Attributes:
        name: of the part.
        facets: its local facets.
        beyond: the other local facets of its sides.
        on: both, with q sample points in each.
        share: 1 at the sample points that are in the part, else 0, (f, q).
        meshed: the same as the mesh has it, (f, q).
    """

    name: str
    facets: Entities
    beyond: Entities
    on: FacetModes
    share: Array
    meshed: Array

    @property
    def missing(self) -> Array:
        """1 at the sample points where the mesh lacks the part, -1 beyond its end, (f, q)."""
        return self.share - self.meshed


def _parts(problem: Problem, bubbles: fem.FunctionSpace) -> Iterator[_Part]:
    """The parts with `where`. Collective."""
    for name, piece in problem.pieces.items():
        if piece.where is not None:
            facets, side = problem.part_facets[name], problem.domain.facets(piece.on)
            on = facet_modes(problem, bubbles, side)
            share, meshed = on.of(piece.where), np.isin(on.facets.local, facets)
            whole = np.broadcast_to(meshed[:, None], share.shape)
            beyond = np.setdiff1d(side, facets).astype(np.int32)
            yield _Part(name, facets, beyond, on, share.astype(np.float64), whole.astype(np.float64))


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
    cells = np.zeros(problem.domain.mesh.topology.index_map(problem.dimension).size_local)
    parts, owned = list(_parts(problem, bubbles)), np.arange(len(examination.forces.reaction), dtype=np.int32)
    if not parts:
        return cells
    holding = placed_forces.reactions(problem, u, examination.forces, examination.states)
    lacking = [_loads(problem, part) + _sums(problem, part) for part in parts]
    for part, tractions in zip(parts, lacking, strict=True):
        if part.name in holding:
            firm, lost = _held(problem, part, holding[part.name].at(owned), examination)
            np.add.at(cells, part.on.facets.cells, _energies(part, firm))
            tractions += part.missing[:, :, None] * lost[:, None]
    return cells + _of_loads(problem, inverse, parts, lacking)


def _held(problem: Problem, part: _Part, forces: Array, examination: Examination) -> tuple[Array, Array]:
    """The squares of the tractions that hold the body firmly at the end, and those of what gives way; (f, d) both.

    A law holds as a support does as far as its tractions rise with the displacement. Collective.

    Args:
        problem: what was solved.
        part: which one.
        forces: all that holds the body there, owned blocks (n, d).
        examination: of the solution.
    """
    giving, rates = _yielding(problem, part.name, examination.states)
    each = ((forces - giving, examination.forces.reaction), (giving, examination.forces.reaction), (rates, 0.0 * rates))
    firm, soft, rising = (_mean(part.on, _at_ends(problem, part, *one)) for one in each)
    stiff = rising * part.on.compliance
    stiff /= 1.0 + stiff
    return firm**2 + stiff * soft**2, (1.0 - stiff) * soft


def _loads(problem: Problem, part: _Part) -> Array:
    """The tractions that the mesh lacks of the loads on a part, at the sample points, nondimensional, (f, q, d)."""
    on, missing = part.on, part.missing
    found: Array = np.zeros((*missing.shape, problem.dimension))
    for load in (effect.surface_load() for where, effect, _ in problem.contributions if where == part.name):
        if load is None:
            continue
        there = np.zeros_like(found)
        for axis, value in enumerate(load.components):
            if value.everywhere:
                there[:, :, axis] = on.of(value)
        if load.pressure is not None and load.pressure.everywhere:
            there -= on.of(load.pressure)[:, :, None] * _outward(problem, on)[:, None]
        found += np.where(missing[:, :, None] == 0.0, 0.0, missing[:, :, None] * there)
    return found / problem.scales.stress


def _sums(problem: Problem, part: _Part) -> Array:
    """The same of sums over a part: spread over more than it, they are less everywhere. Collective."""
    on, d = part.on, problem.dimension
    at, found = on.points.reshape(-1, 3), np.zeros((*part.share.shape, d))
    spread = [effect for where, effect, _ in problem.contributions if where == part.name and effect.is_sum]
    for sign, counted in ((1.0, part.share), (-1.0, part.meshed)) if spread else ():
        areas = (on.areas * counted).ravel() * problem.scales.length ** (d - 1)
        moments = domain_forms.of_points(problem.comm, at[:, :d], areas)
        for effect in spread:
            found += sign * counted[:, :, None] * effect.spread_at(moments, at).reshape(found.shape)
    return found / problem.scales.stress


def _of_loads(problem: Problem, inverse: DualNorm, parts: Sequence[_Part], lacking: Sequence[Array]) -> Array:
    """η_K² of the owned cells that lacking tractions (f, q, d) on the parts' facets add. Collective."""
    comm, d = problem.comm, problem.dimension
    cells = np.zeros(problem.domain.mesh.topology.index_map(d).size_local)
    forces: list[tuple[Entities, Array]] = []
    for part, tractions in zip(parts, lacking, strict=True):
        facets, weighted = part.on.facets, part.on.areas[:, :, None] * tractions
        functions = spaces.simplex_functions(facets.degree, part.on.barycentric, spaces.edge_share(problem.space))
        forces.append((facets.nodes.ravel(), np.einsum("fqd,qn->fnd", weighted, functions).reshape(-1, d)))
        np.add.at(cells, facets.cells, np.sum(np.abs(weighted), axis=(1, 2)) ** 2)
    whole = total(comm, float(cells.sum()))
    if whole == 0.0:
        return cells
    missing = collected(problem.space, forces)
    energy = problem.bulk.energy_by_cell(inverse.solve(problem.combined(missing))[0])
    return total(comm, float(energy.sum())) * cells / whole


def _outward(problem: Problem, on: FacetModes) -> Array:
    """The outward unit normals of facets, (f, d)."""
    d = problem.dimension
    inner = problem.positions[problem.space.dofmap.list[on.facets.cells]].mean(axis=1)[:, :d]
    return outward(on.nodes[:, :d, :d], inner)
