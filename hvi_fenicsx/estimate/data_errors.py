"""What the mesh does not see of data on the boundary that vary within its facets.

Tractions, prescribed displacements and gaps are sampled within facets in Legendre modes; the surface of a half-space
says how far the body gives way to each.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem
from mpi4py import MPI

from .. import geometry
from ..certify.contact_state import ContactState
from ..certify.thresholds import DEFAULT as CERTIFICATE
from ..formula import SpatialValue
from ..mesh import nodes
from ..mesh.boundary_part import Inequalities
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.elastic_operator import stiffness_tensor
from ..problem.problem import Bounds, PrescribedComponent, Problem
from ..problem.scaling import DEFAULT as composition
from ..runtime.mpi import largest, total
from ..typing import Array, Entities, magnitude
from .bubbles import DEFAULT, of_facet, shape
from .traces import ContactFacets, contact_facets, part_points


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
        return self.facets.areas[:, None] * self.weights

    def interpolated(self, at_nodes: Array, at: Array | None = None) -> Array:
        """Values at the nodes (f, n, ...), interpolated at points, on the curve where a facet is curved, (f, q, ...).

        Args:
            at_nodes: the values.
            at: the points in barycentric coordinates, (q, d); by default the sample points.
        """
        functions = spaces.simplex_functions(self.facets.degree, self.barycentric if at is None else at)
        return np.einsum("qn,fn...->fq...", functions, at_nodes)

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
        return self.of(value, at) - self.interpolated(_at(value, self.nodes), at)

    def coefficients(self, sampled: Array) -> Array:
        """The coefficients of sampled values (f, q), (f, m)."""
        return (sampled * self.weights) @ self.values.T

    def energies(self, tractions: Array, compliance: Array, lowest: int) -> Array:
        """Energies a(w, w) of the displacements w that tractions cause, (f,).

        Args:
            tractions: nondimensional, (f, q).
            compliance: of the facets in the direction of the tractions, (f,).
            lowest: degree from which modes count.
        """
        squares = self.coefficients(tractions) ** 2 / (self.degrees + 0.5)
        return self.facets.areas * compliance * np.sum(squares[:, self.degrees >= lowest], axis=1)

    def energies_of_displacements(self, displacements: Array, compliance: Array) -> Array:
        """Energies a(w, w) of displacements w, (f,).

        Args:
            displacements: nondimensional, (f, q).
            compliance: of the facets in the direction of the displacements, (f,).
        """
        squares = self.coefficients(displacements) ** 2 * (self.degrees + 0.5)
        return self.facets.areas / compliance * np.sum(squares, axis=1)


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
    found, d = contact_facets(problem, bubbles, facets), problem.dimension
    degree, family = DEFAULT.data_degree[d - 2], basix.PolynomialType.legendre
    barycentric, weights = nodes.quadrature(d, 2 * degree)
    legendre: Any = basix.tabulate_polynomials(family, nodes.KINDS[d], degree, barycentric[:, 1:])
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
    along = geometry.units(sides[:, 0])
    normals = geometry.units(geometry.across(sides))
    waves = [along]
    if d == 3:
        across, angles = np.cross(normals, along), np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS
        waves = [np.cos(a) * along + np.sin(a) * across for a in angles]
    inverses = np.linalg.inv(np.array([_barnett_lothe(stiffness, wave, normals) for wave in waves]))
    return np.einsum("wfii->fi", inverses) / len(waves)


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
    return np.mean(q - r @ np.linalg.solve(t, np.swapaxes(r, -1, -2)), axis=0)


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
    low = -largest(comm, float(np.max(reach - gaps, initial=0.0)))
    high = largest(comm, float(np.max(gaps, initial=0.0)))
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
    found = np.zeros(problem.domain.mesh.topology.index_map(problem.dimension).size_local)

    known: dict[int, FacetModes] = {}

    def modes(facets: Entities) -> FacetModes:
        if id(facets) not in known:
            known[id(facets)] = facet_modes(problem, bubbles, facets)
        return known[id(facets)]

    for facets, axis, value in tractions(problem):
        on = modes(facets)
        stress = on.of(value) / problem.scales.stress
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
                within = -sign * on.beyond_nodes(gap) / problem.scales.displacement
                np.add.at(found, on.facets.cells, _moved_pressure(problem, bubbles, bounds.surface, on, nodal, within))
    return found


def _unprescribed(problem: Problem, on: FacetModes, part: PrescribedComponent) -> Array:
    """Energies of what interpolation of twice the degree leaves of a prescribed displacement, (f,)."""
    rest = on.beyond_nodes(part.value)
    for index in of_facet(on.facets.degree, problem.dimension):
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
    comm = problem.comm
    if largest(comm, magnitude(within)) <= CERTIFICATE.near:
        return np.zeros(len(within))
    spread = part_points(problem, bubbles, surface, 1).spread
    normals = spread.by_facet(surface.normals).mean(axis=1)
    compliance = np.sum(normals**2 * on.compliance, axis=1) / np.sum(normals**2, axis=1)
    pushes, gaps = (on.interpolated(spread.by_facet(np.maximum(values, 0.0))) for values in nodal)
    free = not _is_supported(problem, surface.normals)
    moved, before = (
        redistributed(comm, on, pushes, gaps + more, compliance, free=free) for more in (within, np.zeros_like(within))
    )
    return on.energies(moved - before, compliance, lowest=0)


def _is_supported(problem: Problem, normals: Array) -> bool:
    """Whether a prescribed component holds the body against a translation along a part's mean normal. Collective."""
    mean = [abs(total(problem.comm, float(along))) for along in normals.sum(axis=0)]
    return any(mean[part.component] > composition.turned_to_prescribed * max(mean) for part in problem.prescribed)
