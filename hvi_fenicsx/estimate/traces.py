"""Γc between its nodes: displacements along some directions at quadrature points, and tractions tested there.

What the nodes of a facet carry is a function of the elements' degree on it. Quadrature points are those on the facets
of a part of the boundary, or on the intersections of two bodies' facets; there displacements are relative ones, a node
that carries nothing has the mean of its neighbours, and what is said of bubbles and nodes is summed over the ranks.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..mesh import facets, nodes
from ..problem import dual_basis, spaces
from ..problem.contact_surface import Surface
from ..problem.facets import Facets
from ..problem.interfaces import Interface
from ..problem.problem import Problem
from ..problem.spaces import global_numbers
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from .bubbles import LocalForces, of_cell, of_facet, shape

Basis = Literal["functions", "hats", "at_ends"]
"""By what values at nodes are interpolated."""


class Trace:
    """Displacements along k directions at quadrature points. Creation is collective.

    Args:
        problem: what was solved.
        points: of a part or an interface.
        surface: the nodes of the part, or of the interface's first side.
        directions: at these, (m, k, d).

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
    """

    def __init__(self, problem: Problem, points: FacetPoints, surface: Surface, directions: Array) -> None:
        self._problem, self._points = problem, points
        self._surface, self._directions, self.weights = surface, directions, points.weights
        own = points.spread.by_facet(directions)
        self._rotations = rotations(own, points.spread.reference)
        self._vectors = self._turned(turned(self._rotations, own))

    def _turned(self, own: Array) -> Array:
        """Directions of nodes (facets, n, k, d) at the points, (f, q, k, d). Collective.

        On curved facets of interfaces they turn as the facets do: they are interpolated as those of one node, turned
        with the normals.
        """
        facets, normals = self._points.facets, self._points.normals
        if normals is None:
            return self._on_facets(self._points.functions, own)
        at_nodes = self._points.spread.by_facet(self._surface.normals)
        one = at_nodes[np.arange(len(own)), self._points.spread.reference]
        alike = own @ rotations_between(np.broadcast_to(one[:, None], at_nodes.shape), at_nodes)
        back = rotations_between(normals, np.broadcast_to(one[facets, None], normals.shape))
        return self._on_facets(self._points.functions, alike) @ back

    def interpolated(self, values: Array, by: Basis = "functions", *, along: bool = False) -> Array:
        """Values at the owned nodes (m, k), interpolated at the points, (f, q, k). Collective.

        Args:
            values: at the nodes.
            by: the elements' functions; those that are linear from node to node ("hats"); the elements' functions at
                the ends of facets in the place of the points ("at_ends").
            along: whether they are components along the directions.
        """
        there = self._points.spread.by_facet(values)
        return self._on_facets(getattr(self._points, by), turned(self._rotations, there) if along else there)

    def of_field(self, u: fem.Function, by: Basis = "functions") -> Array:
        """The values of a displacement of the problem's space, (f, q, k). Collective.

        Args:
            u: the displacement.
            by: as for :meth:`interpolated`.
        """
        there = self._surface.values(self._problem.relative(u.x.array))
        return self.interpolated(np.einsum("mkd,md->mk", self._directions, there), by, along=True)

    def _on_facets(self, functions: Array, values: Array) -> Array:
        """Sums of functions (f, q, n) times values of nodes (facets, n, k, ...)."""
        flat = values.reshape(*values.shape[:2], math.prod(values.shape[2:]))
        found = (self._points.spread.carriers @ flat)[self._points.facets]
        return (functions @ found).reshape(*functions.shape[:2], *values.shape[2:])

    def of_bubbles(self, e: fem.Function) -> Array:
        """The values of bubbles, (f, q, k). Collective."""
        found = np.zeros((*self.weights.shape, self._problem.dimension))
        for side in self._points.sides:
            known = side.by_facet(e.x.array.reshape(-1, found.shape[2])[side.blocks])
            for i, values in enumerate(side.shapes):
                found += side.sign * values[:, :, None] * known[:, i, None]
        return np.einsum("fqkd,fqd->fqk", self._vectors, found)

    def with_bubbles(self, tau: Array) -> list[LocalForces]:
        """∫ τ·w ds of tractions (f, q, k), against the motion of the first side, tested with bubbles. Collective."""
        return self._with_bubbles(np.einsum("fqk,fqkd->fqd", self.weights[:, :, None] * tau, self._vectors), 1)

    def with_nodes(self, tau: Array) -> LocalForces:
        """The same tested with the functions of u_h, at owned blocks. Collective."""
        on_facets = np.zeros(self._rotations.shape[:3])
        forces = np.einsum("fqk,fqn->fnk", self.weights[:, :, None] * tau, self._points.functions)
        np.add.at(on_facets, self._points.facets, forces)
        carried = self._points.spread.forces(np.einsum("fnkl,fnl->fnk", self._rotations, on_facets))
        return self._surface.blocks, np.einsum("mk,mkd->md", carried, self._directions)

    def squared(self, rates: Array) -> list[LocalForces]:
        """∫ Σ rate (v·direction)² ds, v being each bubble; local blocks. Collective.

        Args:
            rates: along the directions, (f, q, k).
        """
        return self._with_bubbles(np.einsum("fqk,fqkd->fqd", self.weights[:, :, None] * rates, self._vectors**2), 2)

    def _with_bubbles(self, vectors: Array, power: int) -> list[LocalForces]:
        """Sums of vectors (f, q, d) times powers of all bubbles, local blocks. Collective."""
        found: list[LocalForces] = []
        for side in self._points.sides:
            each = [np.einsum("fq,fqd->fd", (side.sign * values) ** power, vectors) for values in side.shapes]
            found.append((side.blocks, side.summed(np.stack(each, axis=1))))
        return found


def rotations(directions: Array, reference: Integers) -> Array:
    """Matrices R of the nodes of facets, (f, n, k, k).

    Components c along a node's directions are Rᵀc along those of one node of the facet. Only tangents are turned, the
    last d - 1 directions at most; a normal stays the node's own.

    Args:
        directions: of the nodes of facets, unit vectors, (f, n, k, d).
        reference: the node of each facet whose tangents the others get, (f,).
    """
    count, d = directions.shape[2:]
    turned = slice(max(count - d + 1, 0), None)
    tangents = directions[:, :, turned]
    one = tangents[np.arange(len(tangents)), reference][:, None]
    left, _, right = np.linalg.svd(tangents @ np.swapaxes(one, 2, 3))
    result = np.tile(np.eye(count), (*directions.shape[:2], 1, 1))
    result[:, :, turned, turned] = left @ right
    return result


def turned(rotations: Array, values: Array) -> Array:
    """The components along the directions of one node of each facet, (f, n, k, ...).

    Args:
        rotations: R, (f, n, k, k).
        values: the components along each node's own directions, or these directions, (f, n, k, ...).
    """
    return np.einsum("fnkl,fnk...->fnl...", rotations, values)


def rotations_between(one: Array, other: Array) -> Array:
    """The rotations that take unit vectors to others the shortest way, (..., d, d); these must not be opposite.

    Args:
        one: unit vectors, (..., d).
        other: unit vectors, (..., d).
    """
    both, cosine = one + other, np.sum(one * other, axis=-1)[..., None, None]
    bent = both[..., :, None] * both[..., None, :] / (1.0 + cosine)
    return np.eye(one.shape[-1]) - bent + 2.0 * other[..., :, None] * one[..., None, :]


@dataclass(frozen=True)
class ContactFacets:
    """Facets of Γc (f of them), each with its n nodes, corners first, and its k bubbles (:func:`.bubbles.of_facet`).

    Attributes:
        degree: of the solution.
        nodes: their blocks, (f, n).
        bubbles: the blocks of their bubbles, (f, k).
        areas: over L^(d-1), (f,).
        cells: the cells, (f,).
        local: the facets themselves, (f,).
    """

    degree: int
    nodes: Entities
    bubbles: Entities
    areas: Array
    cells: Entities
    local: Entities


def contact_facets(problem: Problem, space: fem.FunctionSpace, local: Entities) -> ContactFacets:
    """The nodes and bubbles of boundary facets whose cell this rank owns.

    Args:
        problem: the mesh and its displacements.
        space: of bubbles.
        local: the local facets.
    """
    mesh, d = problem.domain.mesh, problem.dimension
    local, cells, number = facets.with_cells(mesh, local)
    degree, on = nodes.degree(problem.space), nodes.facet_nodes(problem.space, local)
    table = np.array(_numbers_in_cell(degree, mesh.topology.cell_name()), dtype=np.int32)
    found = np.take_along_axis(space.dofmap.list[cells], table[number], axis=1)
    points = problem.points[on[:, :d], :d] / problem.scales.length
    return ContactFacets(degree, on, found, facets.areas(points), cells, local)


def _numbers_in_cell(degree: int, cell: str) -> list[list[int]]:
    """The numbers in the cell of the bubbles of each of its facets, which lies opposite to the corner of its number."""
    everywhere = of_cell(degree, cell)
    d = len(everywhere[0]) - 1
    within = of_facet(degree, d)
    return [[everywhere.index((*index[:i], 0, *index[i:])) for index in within] for i in range(d + 1)]


@dataclass(frozen=True, kw_only=True)
class Shared:
    """Nodes or bubbles (n), with the same numbers on all ranks, of facets or intersections (f).

    Attributes:
        comm: the ranks.
        count: n.
        own: those that this rank owns, (m,).
        at: those of each facet, (f, k).
    """

    comm: MPI.Comm
    count: int
    own: Integers
    at: Integers

    def by_facet(self, values: Array) -> Array:
        """Values at the owned ones (m, ...) by facet, (f, k, ...). Collective."""
        every = np.zeros((self.count, *values.shape[1:]))
        every[self.own] = values
        return self.comm.allreduce(every)[self.at]

    def summed(self, values: Array) -> Array:
        """Sums of values (f, k, ·) of facets at the owned ones, (m, ·). Collective."""
        every = np.zeros((self.count, values.shape[2]))
        np.add.at(every, self.at, values)
        return self.comm.allreduce(every)[self.own]


@dataclass(frozen=True, kw_only=True)
class SideBubbles(Shared):
    """The bubbles of one side (:func:`.bubbles.of_facet`) at points of facets or intersections.

    Attributes:
        sign: of the side's displacement in the relative one.
        shapes: the values of each bubble of a facet at the points, (f, q) each.
        blocks: the local blocks of those that this rank owns, (m,).
    """

    sign: float
    shapes: list[Array]
    blocks: Integers


def _side(space: fem.FunctionSpace, degree: int, sign: float, at: Array, bubbles: Integers) -> SideBubbles:
    """The bubbles of facets by their global numbers, (f, k), at points (f, q, d) of these. Collective."""
    comm, d, (start, end) = space.mesh.comm, at.shape[2], space.dofmap.index_map.local_range
    known = np.unique(np.concatenate([numbers.ravel() for numbers in agree(comm, bubbles)]))
    owned = np.flatnonzero((known >= start) & (known < end))
    return SideBubbles(
        comm=comm,
        sign=sign,
        shapes=[shape(index, at.reshape(-1, d)).reshape(at.shape[:2]) for index in of_facet(degree, d)],
        at=np.searchsorted(known, bubbles),
        count=len(known),
        own=owned,
        blocks=known[owned] - start,
    )


def _of_interface(problem: Problem, space: fem.FunctionSpace, side: Facets, name: str) -> Integers:
    """The global numbers of the bubbles of all facets of an interface's side, (facets, k). Collective."""
    local = contact_facets(problem, space, problem.domain.facets([name]))
    own = [global_numbers(problem.space, local.nodes), global_numbers(space, local.bubbles)]
    nodes_of, found = (np.concatenate(parts) for parts in zip(*agree(problem.comm, own), strict=True))
    numbers = np.empty_like(found)
    numbers[np.lexsort(side.nodes.T)] = found[np.lexsort(nodes_of.T)]
    return numbers


@dataclass(frozen=True, kw_only=True)
class FacetPoints:
    """Quadrature points (q) on the facets (f) of a part, or on intersections of those of two bodies.

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
        facets: of the part or of the first side, (f,).
        functions: the basis functions of these facets' nodes at the points, (f, q, n).
        hats: the functions that are linear from node to node, (f, q, n).
        at_ends: the basis functions at the corners of intersections, or at the nodes, (f, ., n).
        normals: of the first side at the points where its facets are curved, else None, (f, q, d).
        sides: the bubbles of the body, or of both.
        spread: from nodes to facets.
    """

    weights: Array
    facets: Integers
    functions: Array
    hats: Array
    at_ends: Array
    normals: Array | None
    sides: tuple[SideBubbles, ...]
    spread: Spread


def part_points(problem: Problem, bubbles: fem.FunctionSpace, surface: Surface, degree: int) -> FacetPoints:
    """Points on the facets of a part of the boundary whose cells this rank owns. Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        surface: the part.
        degree: of the quadrature.
    """
    comm, on = problem.comm, contact_facets(problem, bubbles, surface.facets)
    at, weights = nodes.quadrature(problem.dimension, degree)
    functions = spaces.simplex_functions(on.degree, at, spaces.edge_share(problem.space))
    count, own = len(on.nodes), global_numbers(problem.space, surface.blocks)
    known, kept = np.unique(np.concatenate(agree(comm, own))), np.ones(on.nodes.shape, dtype=np.bool_)
    functions, hats, ends, places = (
        np.broadcast_to(values, (count, *values.shape))
        for values in (functions, nodes.hats(on.degree, at), np.eye(on.nodes.shape[1]), at)
    )
    return FacetPoints(
        weights=on.areas[:, None] * weights,
        facets=np.arange(count),
        functions=functions,
        hats=hats,
        at_ends=ends,
        normals=None,
        sides=(_side(bubbles, on.degree, 1.0, places, global_numbers(bubbles, on.bubbles)),),
        spread=Spread(
            comm=comm,
            count=len(known),
            own=np.searchsorted(known, own),
            at=np.searchsorted(known, global_numbers(problem.space, on.nodes)),
            kept=kept,
            shares=np.ones((len(own), 1)),
            carriers=dual_basis.means(kept),
        ),
    )


def interface_points(problem: Problem, bubbles: fem.FunctionSpace, interface: Interface, degree: int) -> FacetPoints:
    """Points on the intersections that this rank looks at. Collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        interface: one of the problem's.
        degree: of the quadrature.
    """
    d, comm, first = problem.dimension, problem.comm, interface.first
    overlaps, names = interface.overlaps, interface.sides
    own = np.arange(comm.rank, len(overlaps.areas), comm.size)
    rule, weights = nodes.quadrature(d, degree)
    points = overlaps.sampled(rule, weights, own)
    size, found = (len(own), len(weights)), list[SideBubbles]()
    for side, name, sign, at, of in (
        (interface.first, names.first, 1.0, points.on_first, overlaps.first),
        (interface.second, names.second, -1.0, points.on_second, overlaps.second),
    ):
        bubbles_of = _of_interface(problem, bubbles, side, name)[of[own]]
        found.append(_side(bubbles, side.degree, sign, at.reshape(*size, d), bubbles_of))
    functions = first.functions(points.on_first.reshape(*size, d))
    return FacetPoints(
        weights=np.asarray(points.weights.reshape(size) / float(problem.scales.length) ** (d - 1)),
        facets=overlaps.first[own],
        functions=functions,
        hats=nodes.hats(first.degree, points.on_first.reshape(-1, d)).reshape(functions.shape),
        at_ends=first.functions(overlaps.on_first[own]),
        normals=first.normals_at(points.first, points.on_first).reshape(*size, d) if first.curved else None,
        sides=tuple(found),
        spread=_of_carriers(problem, interface),
    )


@dataclass(frozen=True, kw_only=True)
class Spread(Shared):
    """Values at the nodes that carry something as values at the nodes of facets.

    Attributes:
        kept: which of the facet's nodes are their own carriers, (facets, k).
        shares: by how much a relative displacement of 1 at owned nodes moves the first side there, (m, 1).
        carriers: what the value at each node is the mean of, rows of weights, (facets, k, k).
    """

    kept: Mask
    shares: Array
    carriers: Array

    @functools.cached_property
    def reference(self) -> Integers:
        """A node of each facet's carriers, (facets,)."""
        return np.argmax(self.carriers.any(axis=1), axis=1)

    def forces(self, values: Array) -> Array:
        """Forces on the functions of facets' nodes (facets, k, ·) as forces on the relative displacements, (m, ·).

        Beside a node that carries nothing a relative displacement of 1 moves the first side by another amount than 1:
        the rows of the problem (:mod:`.dual_basis`) say by how much. So a uniform traction has the problem's own
        nodal forces. Collective.
        """
        return self.summed(np.where(self.kept[:, :, None], values, 0.0)) * self.shares


def _of_carriers(problem: Problem, interface: Interface) -> Spread:
    """The way from the carriers of an interface, some of whose nodes carry nothing. Collective."""
    first, weights = interface.first, interface.rows.weights
    own = global_numbers(problem.space, interface.surface.blocks)
    known, kept = np.flatnonzero(weights > 0.0), weights[first.nodes] > 0.0
    at = np.where(kept, np.searchsorted(known, first.nodes), 0)
    carriers = dual_basis.means(kept)
    for facet, node in dual_basis.adopted(first, interface.overlaps, kept).items():
        at[facet, 0], carriers[facet, :, 0] = np.searchsorted(known, node), 1.0
    return Spread(
        comm=problem.comm,
        count=len(known),
        own=np.searchsorted(known, own),
        at=at,
        kept=kept,
        shares=1.0 / interface.rows.first.diagonal()[own][:, None],
        carriers=carriers,
    )
