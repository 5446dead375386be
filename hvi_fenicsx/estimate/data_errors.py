"""What the mesh does not see of the data on the boundary: what varies within facets, and parts that end within one.

Tractions, prescribed displacements and gaps are sampled within facets in Legendre modes; the surface of a half-space
says how far the body gives way to each. A facet belongs to a part with `where` as a whole, or not at all: a load that
is too much there, or too little, is a load of its own, and so is the traction of a law that gives way. The displacement
that they cause is found in u_h's space, and counts in the cells at these facets: smaller ones make it smaller, wherever
the body gives way. What holds the body firmly is singular at its end.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem, la
from mpi4py import MPI

from ..certify import placed_forces
from ..certify.certificate import Examination
from ..certify.contact_state import ContactState
from ..certify.thresholds import DEFAULT as CERTIFICATE
from ..formula import SpatialValue
from ..mesh import facets as facet_sizes
from ..mesh import nodes
from ..mesh.boundary_part import Inequalities
from ..problem import domain_forms, references, spaces
from ..problem.contact_surface import Surface
from ..problem.elastic_operator import stiffness_tensor
from ..problem.facets import function_integrals, outward
from ..problem.problem import Bounds, PrescribedComponent, Problem
from ..problem.scaling import DEFAULT as composition
from ..runtime.mpi import total
from ..typing import Array, Entities, Mask
from .bubbles import DEFAULT, gathered, of_facet, quadrature, shape, summed
from .dual_norm import DualNorm
from .traces import ContactFacets, PartPoints, contact_facets


def varies(value: SpatialValue | None) -> bool:
    """Whether a value varies in space and is known between nodes."""
    return value is not None and value.everywhere and not value.is_number


def tractions(problem: Problem) -> Iterator[tuple[Entities, int, SpatialValue]]:
    """The facets, the component and the value of each traction that varies."""
    for where, effect, _ in problem.contributions:
        load = effect.surface_load()
        if where is None or load is None:
            continue
        for axis, value in enumerate(load.components):
            if varies(value):
                yield problem.part_facets[where], axis, value


def gaps(problem: Problem) -> Iterator[tuple[Bounds, SpatialValue | None, SpatialValue | None]]:
    """The bounds of each part of the boundary with contact, and the values of lower and upper -u·n that vary."""
    stated = [b for where, _, c in problem.contributions if where is not None for b in c.bounds]
    for bounds, values in zip(problem.bounds, stated, strict=True):
        if problem.interface_of(bounds.surface) is not None:
            continue
        lower, upper = (value if varies(value) else None for value in (values.lower, values.upper))
        yield bounds, lower, upper


def everything(problem: Problem) -> Iterator[tuple[Entities, SpatialValue]]:
    """The facets and the value of all that varies on the boundary."""
    for facets, _, value in tractions(problem):
        yield facets, value
    for part in problem.prescribed:
        if varies(part.value):
            yield part.facets, part.value
    for bounds, *values in gaps(problem):
        yield from ((bounds.surface.facets, value) for value in values if value is not None)


@dataclass(frozen=True)
class FacetModes:
    """Legendre modes (m of them) on facets (f), at q sample points in each.

    Attributes:
        facets: whose cells this rank owns.
        nodes: their nodes, corners first, m, (f, n, 3).
        barycentric: the sample points in barycentric coordinates, (q, d).
        weights: of the points; their sum is 1, (q,).
        values: of the modes at the points, orthonormal under the weights, (m, q).
        degrees: of the modes, (m,).
        compliance: nondimensional displacement by traction of the wave of one half-length, along each axis, (f, d).
    """

    facets: ContactFacets
    nodes: Array
    barycentric: Array
    weights: Array
    values: Array
    degrees: Array
    compliance: Array

    @property
    def areas(self) -> Array:
        """What the sample points stand for, over L^(d-1), (f, q)."""
        return np.asarray(self.facets.areas[:, None] * self.weights)

    def interpolated(self, at_nodes: Array, at: Array | None = None) -> Array:
        """Values at the nodes (f, n, ...), interpolated at points, on the curve where a facet is curved, (f, q, ...).

        Args:
            at_nodes: the values.
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        functions = spaces.simplex_functions(self.facets.degree, self.barycentric if at is None else at)
        return np.asarray(np.einsum("qn,fn...->fq...", functions, at_nodes))

    @functools.cached_property
    def points(self) -> Array:
        """The sample points, m, (f, q, 3)."""
        return self.interpolated(self.nodes)

    def of(self, value: SpatialValue | Inequalities, at: Array | None = None) -> Array:
        """A value, or where inequalities hold, at points, SI, (f, q).

        Args:
            value: on the boundary.
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        return _at(value, self.points if at is None else self.interpolated(self.nodes, at))

    def beyond_nodes(self, value: SpatialValue, at: Array | None = None) -> Array:
        """What interpolation between the nodes leaves of a value at points, SI, (f, q).

        Args:
            value: on the boundary.
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        return np.asarray(self.of(value, at) - self.interpolated(_at(value, self.nodes), at))

    def coefficients(self, sampled: Array) -> Array:
        """The coefficients of sampled values (f, q), (f, m)."""
        return np.asarray((sampled * self.weights) @ self.values.T)

    def energies(self, tractions: Array, compliance: Array, lowest: int) -> Array:
        """Energies a(w, w) of the displacements w that tractions cause, (f,).

        Args:
            tractions: nondimensional, (f, q).
            compliance: of the facets in the direction of the tractions, (f,).
            lowest: degree from which modes count.
        """
        squares = self.coefficients(tractions) ** 2 / (self.degrees + 0.5)
        return np.asarray(self.facets.areas * compliance * np.sum(squares[:, self.degrees >= lowest], axis=1))

    def energies_of_displacements(self, displacements: Array, compliance: Array) -> Array:
        """Energies a(w, w) of displacements w, (f,).

        Args:
            displacements: nondimensional, (f, q).
            compliance: of the facets in the direction of the displacements, (f,).
        """
        squares = self.coefficients(displacements) ** 2 * (self.degrees + 0.5)
        return np.asarray(self.facets.areas / compliance * np.sum(squares, axis=1))


def _at(value: SpatialValue | Inequalities, points: Array) -> Array:
    """A value at points (f, q, 3), m; SI, (f, q)."""
    return np.asarray(value.at(points.reshape(-1, 3)).reshape(points.shape[:2]))


def facet_modes(problem: Problem, bubbles: fem.FunctionSpace, facets: Entities) -> FacetModes:
    """The modes on boundary facets, at points that are exact for products of them. Collective.

    Args:
        problem: the mesh.
        bubbles: the space of bubbles.
        facets: the local facets.
    """
    found, d = contact_facets(problem, bubbles, facets), problem.scales.dimension
    degree, kind = DEFAULT.data_degree[d - 2], "interval" if d == 2 else "triangle"
    barycentric, weights = quadrature(kind, 2 * degree)
    family, cell = basix.PolynomialType.legendre, basix.CellType[kind]
    legendre: Any = basix.tabulate_polynomials(family, cell, degree, barycentric[:, 1:])
    values = legendre / math.sqrt(math.factorial(d - 1))
    degrees = np.concatenate([np.full(math.comb(n + d - 2, d - 2), n) for n in range(degree + 1)])
    material, places = stiffness_tensor(problem.bulk, found.cells), problem.positions[found.nodes]
    size = (math.factorial(d - 1) * found.areas) ** (1 / (d - 1))  # in space, a leg of a right triangle
    compliance = size[:, None] / math.pi * surface_compliance(material, places[:, :d])
    return FacetModes(found, places, barycentric, weights, values, degrees, compliance)


_ANGLES = 32
"""Angles of the rectangle rule on a periodic integrand; an isotropic material is met to 1e-12."""

_DIRECTIONS = 4
"""Directions of the waves on a surface in space, over which the compliance is averaged."""


def surface_compliance(stiffness: Array, corners: Array) -> Array:
    """Diagonal of L⁻¹, surface displacement by traction for k = 1, along each axis, (f, d).

    Args:
        stiffness: C_ijkl below each facet, (f, d, d, d, d).
        corners: of the facets, (f, d, 3); in space, the mean of all waves along the facet.
    """
    d = corners.shape[1]
    sides = np.asarray((corners[:, 1:] - corners[:, :1])[:, :, :d], dtype=np.float64)
    along = _unit(sides[:, 0])
    normals = (
        np.stack([along[:, 1], -along[:, 0]], axis=1)
        if d == 2
        else _unit(np.asarray(np.cross(along, sides[:, 1]), dtype=np.float64))
    )
    waves = [along]
    if d == 3:
        across, angles = np.cross(normals, along), np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
        waves = [np.cos(a) * along + np.sin(a) * across for a in angles]
    inverses = np.linalg.inv(np.array([_barnett_lothe(stiffness, wave, normals) for wave in waves]))
    return np.asarray(np.einsum("wfii->fi", inverses) / len(waves))


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def _barnett_lothe(stiffness: Array, wave: Array, normal: Array) -> Array:
    """L of waves and normals (f, d), (f, d, d)."""
    along, across = (np.einsum("fijkl,fj->fikl", stiffness, one) for one in (wave, normal))
    ww, nw = (np.einsum("fikl,fl->fik", one, wave) for one in (along, across))
    wn, nn = (np.einsum("fikl,fl->fik", one, normal) for one in (along, across))
    angles = (np.arange(_ANGLES) * np.pi / _ANGLES)[:, None, None, None]
    c, s = np.cos(angles), np.sin(angles)  # of m = c wave + s normal, n = c normal - s wave
    q = c * c * ww + c * s * (wn + nw) + s * s * nn
    r = c * c * wn + c * s * (nn - ww) - s * s * nw
    t = c * c * nn - c * s * (wn + nw) + s * s * ww
    return np.asarray(np.mean(q - r @ np.linalg.solve(t, np.swapaxes(r, -1, -2)), axis=0))


def redistributed(
    comm: MPI.Comm, on: FacetModes, pushes: Array, gaps: Array, compliance: Array, *, free: bool
) -> Array:
    """Pressures p ≥ 0 with w ≤ gap and p (gap - w) = 0, w being what the pushes less p cause, (f, q). Collective.

    Args:
        comm: the ranks.
        on: the facets.
        pushes: pressures that are given, (f, q).
        gaps: how far the facets are from the obstacle, (f, q).
        compliance: of the facets along the normal, (f,).
        free: whether the body may move along the normal.
    """
    kernel = (on.values.T / (on.degrees + 0.5)) @ on.values * on.weights
    missing = np.eye(len(on.weights)) - on.values.T @ on.values * on.weights
    kernel += missing / (on.degrees[-1] + 1.5)
    within, pressure = gaps / compliance[:, None], pushes.copy()
    if not free:
        return _solved(kernel, pushes, within, pressure, 4 * DEFAULT.coupled_rounds)
    wanted = total(comm, float(np.sum(on.areas * pushes)))
    if wanted == 0.0:
        return pressure
    reach = (pushes @ kernel.T) * compliance[:, None]
    low = comm.allreduce(float(np.min(gaps - reach, initial=0.0)), op=MPI.MIN)
    high = comm.allreduce(float(np.max(gaps, initial=0.0)), op=MPI.MAX)
    for _ in range(DEFAULT.bubble_steps):
        shift = (low + high) / 2
        pressure = _solved(kernel, pushes, within - shift / compliance[:, None], pressure, DEFAULT.coupled_rounds)
        more = total(comm, float(np.sum(on.areas * pressure))) > wanted
        low, high = (low, shift) if more else (shift, high)
    return pressure


def _solved(kernel: Array, pushes: Array, within: Array, pressure: Array, sweeps: int) -> Array:
    """Projected Gauss-Seidel sweeps over the points, all facets at once, (f, q)."""
    p = pressure.copy()
    beyond = (pushes - p) @ kernel.T - within
    for _ in range(sweeps):
        for i, own in enumerate(np.diag(kernel)):
            change = np.maximum(beyond[:, i] / own, -p[:, i])
            p[:, i] += change
            beyond -= change[:, None] * kernel[:, i]
    return p


def squares(problem: Problem, bubbles: fem.FunctionSpace, states: Sequence[ContactState]) -> Array:
    """η_K² of the owned cells that the data within facets add. Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        states: of the parts of Γc at the solution.
    """
    found = np.zeros(problem.domain.mesh.topology.index_map(problem.scales.dimension).size_local)

    known: dict[int, FacetModes] = {}

    def modes(facets: Entities) -> FacetModes:
        if id(facets) not in known:
            known[id(facets)] = facet_modes(problem, bubbles, facets)
        return known[id(facets)]

    for facets, axis, value in tractions(problem):
        on = modes(facets)
        stress = np.asarray(on.of(value) / problem.scales.stress)
        np.add.at(found, on.facets.cells, on.energies(stress, on.compliance[:, axis], lowest=on.facets.degree))
    for part in problem.prescribed:
        if varies(part.value):
            on = modes(part.facets)
            np.add.at(found, on.facets.cells, _unprescribed(problem, on, part))
    for bounds, *values in gaps(problem):
        state = next(s for s in states if s.surface is bounds.surface)
        for gap, sign, bound in zip(values, (-1.0, 1.0), (bounds.upper, -bounds.lower), strict=True):
            if gap is not None:
                on, nodal = modes(bounds.surface.facets), (sign * state.contact_pressure, bound + sign * state.normal)
                within = np.asarray(-sign * on.beyond_nodes(gap) / problem.scales.displacement)
                np.add.at(found, on.facets.cells, _moved_pressure(problem, bubbles, bounds.surface, on, nodal, within))
    return found


def _unprescribed(problem: Problem, on: FacetModes, part: PrescribedComponent) -> Array:
    """Energies of what interpolation of twice the degree leaves of a prescribed displacement, (f,)."""
    rest = on.beyond_nodes(part.value)
    for index in of_facet(on.facets.degree, problem.scales.dimension):
        there = on.beyond_nodes(part.value, np.array([index]) / sum(index))
        rest -= there * shape(index, on.barycentric)
    rest /= problem.scales.displacement
    return on.energies_of_displacements(rest, on.compliance[:, part.component])


def _moved_pressure(
    problem: Problem,
    bubbles: fem.FunctionSpace,
    surface: Surface,
    on: FacetModes,
    nodal: Sequence[Array],
    within: Array,
) -> Array:
    """Energies of what a gap's variation within facets changes of the contact pressure, (f,). Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        surface: the part.
        on: its facets.
        nodal: pressure of the body against the obstacle, and distance from it, at the nodes, (m,) both.
        within: what interpolation between the nodes leaves of the gap at the sample points, (f, q).
    """
    comm = problem.domain.mesh.comm
    if comm.allreduce(float(np.max(np.abs(within), initial=0.0)), op=MPI.MAX) <= CERTIFICATE.near:
        return np.zeros(len(within))
    at = PartPoints(problem, bubbles, surface, 1)
    normals = at.of_nodes(surface.normals).mean(axis=1)
    compliance = np.sum(normals**2 * on.compliance, axis=1) / np.sum(normals**2, axis=1)
    pushes, gaps = (on.interpolated(at.of_nodes(np.maximum(values, 0.0)[:, None])[:, :, 0]) for values in nodal)
    free = not _is_supported(problem, surface.normals)
    moved, before = (
        redistributed(comm, on, pushes, gaps + more, compliance, free=free) for more in (within, np.zeros_like(within))
    )
    return on.energies(moved - before, compliance, lowest=0)


def _is_supported(problem: Problem, normals: Array) -> bool:
    """Whether a prescribed component holds the body against a translation along a part's mean normal. Collective."""
    mean = [abs(total(problem.domain.mesh.comm, float(along))) for along in normals.sum(axis=0)]
    return any(mean[part.component] > composition.turned_to_prescribed * max(mean) for part in problem.prescribed)


def _energies(part: _Part, squares: Array) -> Array:
    """η_K² of facets on which a firm hold ends elsewhere than in the scene, (f,).

    Args:
        part: that ends.
        squares: of the mean tractions over the facets at the end, (f, d).
    """
    on, moved = part.on, np.sum(part.on.weights * part.missing, axis=1)
    costs = np.pi**2 / 4.0 * np.abs(moved) * on.facets.areas * np.sum(squares * on.compliance, axis=1)
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


def _mean(on: FacetModes, ends: Array) -> Array:
    """The mean over those corners of each facet at which a part ends, of local blocks (n, d); (f, d)."""
    values = ends[on.facets.corners]
    count = np.any(values, axis=2).sum(axis=1)
    return np.asarray(values.sum(axis=1) / np.maximum(count, 1)[:, None])


def _yielding(problem: Problem, part: str, states: Sequence[ContactState]) -> tuple[Array, Array]:
    """What laws of a part put on the body off their kinks, and how fast that rises; owned blocks (n, d)."""
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
    return np.asarray(values / np.maximum(count.array, 1.0)[:, None])


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
        return np.asarray(self.share - self.meshed)


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


def squares_at_ends(
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
    return np.asarray(cells + _of_loads(problem, inverse, parts, lacking))


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
    found: Array = np.zeros((*missing.shape, problem.scales.dimension))
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
    return np.asarray(found / problem.scales.stress)


def _sums(problem: Problem, part: _Part) -> Array:
    """The same of sums over a part: spread over more than it, they are less everywhere. Collective."""
    on, d = part.on, problem.scales.dimension
    at, found = on.points.reshape(-1, 3), np.zeros((*part.share.shape, d))
    spread = [effect for where, effect, _ in problem.contributions if where == part.name and effect.is_sum]
    for sign, counted in ((1.0, part.share), (-1.0, part.meshed)) if spread else ():
        areas = (on.areas * counted).ravel() * problem.scales.length ** (d - 1)
        moments = domain_forms.of_points(problem.domain.mesh.comm, at[:, :d], areas)
        for effect in spread:
            found += sign * counted[:, :, None] * effect.spread_at(moments, at).reshape(found.shape)
    return np.asarray(found / problem.scales.stress)


def _of_loads(problem: Problem, inverse: DualNorm, parts: Sequence[_Part], lacking: Sequence[Array]) -> Array:
    """η_K² of the owned cells that lacking tractions (f, q, d) on the parts' facets add. Collective."""
    comm, d = problem.domain.mesh.comm, problem.scales.dimension
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
    missing = gathered(problem.space, summed(forces, d)).everywhere(problem.space.dofmap.index_map.size_local)
    energy = problem.bulk.energy_by_cell(inverse.solve(problem.combined(missing))[0])
    return np.asarray(total(comm, float(energy.sum())) * cells / whole)


def _outward(problem: Problem, on: FacetModes) -> Array:
    """The outward unit normals of facets, (f, d)."""
    d = problem.scales.dimension
    inner = problem.positions[problem.space.dofmap.list[on.facets.cells]].mean(axis=1)[:, :d]
    return outward(on.nodes[:, :d, :d], inner)
