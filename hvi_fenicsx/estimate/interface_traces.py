"""Interfaces between the nodes of both sides: relative displacements at quadrature points, tractions tested there.

It is for an interface what :class:`.contact_facets.PartTrace` is for a part of the boundary. What the first side's
nodes carry is a function of the elements' degree on its facets; a node that carries nothing has the mean of its
neighbours. What the intersections of facets say of bubbles and nodes is summed over the ranks.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..mesh import nodes
from ..problem import curved_overlaps, dual_basis
from ..problem.contact_surface import Surface
from ..problem.facet_overlaps import Facets
from ..problem.interfaces import Interface
from ..problem.problem import Problem
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from .bubbles import BlockForces, of_facet, quadrature, shape, summed
from .contact_facets import contact_facets, rotations, rotations_between, turned, turned_back


@dataclass(frozen=True, kw_only=True)
class SideBubbles:
    """The bubbles (n) of one side's facets, the same numbers on all ranks.

    Attributes:
        of_facet: the bubbles of each facet (:func:`.bubbles.of_facet`), (f, k).
        count: n.
        owned: those that this rank owns, (m,).
        blocks: their local blocks, (m,).
    """

    of_facet: Integers
    count: int
    owned: Integers
    blocks: Integers


def _bubbles_of(problem: Problem, space: fem.FunctionSpace, facets: Facets, side: str) -> SideBubbles:
    """The bubbles of a side. Collective."""
    local = contact_facets(problem, space, problem.domain.facets([side]))
    own = [_numbers(problem.space, local.nodes), _numbers(space, local.bubbles)]
    nodes_of, found = (np.concatenate(parts) for parts in zip(*agree(problem.domain.mesh.comm, own), strict=True))
    order, wanted = np.lexsort(nodes_of.T), np.lexsort(facets.nodes.T)
    of_facet = np.empty((len(wanted), found.shape[1]), dtype=np.int64)
    of_facet[wanted] = found[order]
    known, numbers = np.unique(of_facet, return_inverse=True)
    start, end = space.dofmap.index_map.local_range
    owned = np.flatnonzero((known >= start) & (known < end))
    return SideBubbles(
        of_facet=numbers.reshape(of_facet.shape), count=len(known), owned=owned, blocks=known[owned] - start
    )


def _numbers(space: fem.FunctionSpace, blocks: Entities) -> Integers:
    """Local blocks by their global numbers."""
    found = space.dofmap.index_map.local_to_global(np.ascontiguousarray(blocks.ravel()))
    return np.asarray(found, dtype=np.int64).reshape(blocks.shape)


def _shapes(degree: int, at: Array) -> list[Array]:
    """The values of each bubble of a facet at points (f, q, d), (f, q)."""
    d = at.shape[2]
    return [shape(index, at.reshape(-1, d)).reshape(at.shape[:2]) for index in of_facet(degree, d)]


class InterfacePoints:
    """Quadrature points (q) on the intersections (f) that this rank looks at. Creation is collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        interface: one of the problem's.
        degree: of the quadrature.

    Attributes:
        degree: of the elements.
        weights: of the points, over L^(d-1), (f, q).
        facets: of the first side and of the second, (f,) each.
        shapes: the values of each of their bubbles at the points, (f, q) each.
        functions: the basis functions of the first side's nodes at the points, (f, q, n).
        hats: the functions that are linear from node to node, (f, q, n).
        at_ends: the basis functions at the corners of the intersections, (f, d, n).
        normals: of the first side at the points where facets are curved, else None, (f, q, d).
        sides: the bubbles of both sides.
        spread: what the first side's nodes carry, on its facets.
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace, interface: Interface, degree: int) -> None:
        d, comm = problem.scales.dimension, problem.domain.mesh.comm
        overlaps, names = interface.overlaps, interface.sides
        own = np.arange(comm.rank, len(overlaps.areas), comm.size)
        rule, weights = quadrature("interval" if d == 2 else "triangle", degree)
        points = overlaps.sampled(rule, weights, own)
        self.weights: Array = np.asarray(points.weights.reshape(len(own), -1) / float(problem.scales.length) ** (d - 1))
        self.facets = overlaps.first[own], overlaps.second[own]
        places = [on.reshape(*self.weights.shape, d) for on in (points.on_first, points.on_second)]
        first = interface.first
        normals = curved_overlaps.normals(first, points) if interface.curved else None
        self.normals = None if normals is None else normals.reshape(*self.weights.shape, d)
        self.degree, flat = first.degree, places[0].reshape(-1, d)
        self.shapes = [_shapes(self.degree, at) for at in places]
        self.functions, self.at_ends = first.functions(places[0]), first.functions(overlaps.on_first[own])
        self.hats = nodes.hats(self.degree, flat).reshape(self.functions.shape)
        self.sides = (
            _bubbles_of(problem, bubbles, first, names.first),
            _bubbles_of(problem, bubbles, interface.second, names.second),
        )
        self.spread = _Spread(problem, interface)


class _Spread:
    """Values at the nodes that carry something as values at the nodes of the first side's facets.

    Attributes:
        carriers: what the value at each node is the mean of, rows of weights, (f, n, n).
        reference: a node of each facet's carriers, (f,).
    """

    def __init__(self, problem: Problem, interface: Interface) -> None:
        self._comm: MPI.Comm = problem.domain.mesh.comm
        first, weights = interface.first, interface.rows.weights
        start = problem.space.dofmap.index_map.local_range[0]
        own = start + interface.surface.blocks.astype(np.int64)
        known = np.flatnonzero(weights > 0.0)
        self._count, self._own = len(known), np.searchsorted(known, own)
        self._kept = weights[first.nodes] > 0.0
        at = np.searchsorted(known, first.nodes).clip(max=len(known) - 1)
        self._at = np.where(self._kept, at, 0)
        self._shares = (weights[own] / interface.rows.first.diagonal()[own])[:, None]
        self.carriers = _means(self._kept)
        for facet, node in dual_basis.adopted(first, interface.overlaps, self._kept).items():
            self._at[facet, 0], self.carriers[facet, :, 0] = np.searchsorted(known, node), 1.0
        self.reference: Integers = np.argmax(self.carriers.any(axis=1), axis=1)

    def of_carriers(self, values: Array) -> Array:
        """Values at the owned nodes (m, ...) by facet and carrier, (facets, n, ...). Collective."""
        every = np.zeros((self._count, *values.shape[1:]))
        every[self._own] = values
        return np.asarray(self._comm.allreduce(every)[self._at])

    def on_facets(self, values: Array) -> Array:
        """Values of carriers (facets, n, k) at the nodes of all facets, (facets, n, k)."""
        return np.asarray(self.carriers @ values)

    def summed(self, values: Array) -> Array:
        """Forces on the functions of facets' nodes (facets, n, k) as forces on the relative displacements, (m, k).

        Beside a node that carries nothing a relative displacement of 1 moves the first side by another amount than 1:
        the rows of the problem (:mod:`.dual_basis`) say by how much. So a uniform traction has the problem's own
        nodal forces. Collective.
        """
        every = np.zeros((self._count, values.shape[2]))
        np.add.at(every, self._at[self._kept], values[self._kept])
        return np.asarray(self._comm.allreduce(every)[self._own] * self._shares)


def _means(kept: Mask) -> Array:
    """Weights (f, n, n) by which nodes that carry something (f, n) stay as they are, others are the mean of these."""
    count = kept.shape[1]
    shares = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1)
    return np.asarray(np.where(kept[:, :, None], np.eye(count), shares[:, None, :]))


class InterfaceTrace:
    """Relative displacements of an interface along k directions, at quadrature points. Creation is collective.

    Args:
        problem: what was solved.
        points: of the interface.
        surface: the nodes of its first side.
        directions: at these, (m, k, d).

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
    """

    def __init__(self, problem: Problem, points: InterfacePoints, surface: Surface, directions: Array) -> None:
        self._problem, self._points = problem, points
        self._surface, self._directions, self.weights = surface, directions, points.weights
        own = points.spread.of_carriers(directions)
        self._rotations = rotations(own, points.spread.reference)
        self._vectors = self._turned(turned(self._rotations, own))

    def _turned(self, own: Array) -> Array:
        """Directions of carriers (facets, n, k, d) at the points, (f, q, k, d). Collective.

        On curved facets they turn as the facets do: they are interpolated as those of one carrier, turned with the
        normals.
        """
        facets, normals = self._points.facets[0], self._points.normals
        if normals is None:
            return self._on_facets(self._points.functions, own)
        spread = self._points.spread
        at_carriers = spread.of_carriers(self._surface.normals)
        one = at_carriers[np.arange(len(own)), spread.reference]
        alike = own @ rotations_between(np.broadcast_to(one[:, None], at_carriers.shape), at_carriers)
        back = rotations_between(normals, np.broadcast_to(one[facets, None], normals.shape))
        return np.asarray(self._on_facets(self._points.functions, alike) @ back)

    def interpolated(self, values: Array) -> Array:
        """The function with coefficients at the owned nodes (m, k) at the points, (f, q, k). Collective."""
        return self._combined(self._points.functions, values)

    def interpolated_components(self, values: Array) -> Array:
        """As :meth:`interpolated`, of components along the directions. Collective."""
        return self._components(self._points.functions, values)

    def at_nodes(self, values: Array) -> Array:
        """The function with coefficients at the owned nodes at the corners of intersections, (f, d, k). Collective."""
        return self._combined(self._points.at_ends, values)

    def components_at_nodes(self, values: Array) -> Array:
        """As :meth:`at_nodes`, of components along the directions. Collective."""
        return self._components(self._points.at_ends, values)

    def from_node_to_node(self, values: Array) -> Array:
        """Values at the owned nodes (m, k), linear from node to node; (f, q, k). Collective."""
        return self._combined(self._points.hats, values)

    def of_field(self, u: fem.Function) -> Array:
        """The relative values of a displacement of the problem's space, (f, q, k). Collective."""
        return self.interpolated_components(self._along(u))

    def of_field_from_node_to_node(self, u: fem.Function) -> Array:
        """Its coefficients, linear from node to node, (f, q, k). Collective."""
        return self._components(self._points.hats, self._along(u))

    def _along(self, u: fem.Function) -> Array:
        """The relative coefficients of a displacement along the directions at the owned nodes, (m, k). Collective."""
        there = self._surface.values(self._problem.relative(u.x.array))
        return np.asarray(np.einsum("mkd,md->mk", self._directions, there))

    def _combined(self, functions: Array, values: Array) -> Array:
        spread = self._points.spread
        return np.asarray(functions @ spread.on_facets(spread.of_carriers(values))[self._points.facets[0]])

    def _components(self, functions: Array, values: Array) -> Array:
        """Sums of functions (f, q, n) times components at the owned nodes (m, k). Collective."""
        spread = self._points.spread
        return self._on_facets(functions, turned(self._rotations, spread.of_carriers(values)))

    def _on_facets(self, functions: Array, values: Array) -> Array:
        """Sums of functions (f, q, n) times values of carriers (facets, n, k, ...)."""
        found = self._points.spread.on_facets(values.reshape(*values.shape[:2], -1))[self._points.facets[0]]
        return np.asarray(functions @ found).reshape(*functions.shape[:2], *values.shape[2:])

    def of_bubbles(self, e: fem.Function) -> Array:
        """The relative values of bubbles, (f, q, k). Collective."""
        found = np.zeros((*self.weights.shape, self._problem.scales.dimension))
        blocks = e.x.array.reshape(-1, found.shape[2])
        for sign, side, facet, shapes in self._sides():
            known = np.zeros((side.count, found.shape[2]))
            known[side.owned] = blocks[side.blocks]
            known = self._problem.domain.mesh.comm.allreduce(known)
            for i, values in enumerate(shapes):
                found += sign * values[:, :, None] * known[side.of_facet[facet, i]][:, None]
        return np.asarray(np.einsum("fqkd,fqd->fqk", self._vectors, found))

    def tested(self, tau: Array) -> tuple[BlockForces, BlockForces]:
        """∫ τ·w ds of tractions (f, q, k): with both sides' bubbles and at nodes, owned blocks. Collective.

        Args:
            tau: against the motion of the first side.
        """
        scaled = self.weights[:, :, None] * tau
        found = self._summed(np.einsum("fqk,fqkd->fqd", scaled, self._vectors), 1)
        on_facets = np.zeros(self._rotations.shape[:3])
        np.add.at(on_facets, self._points.facets[0], np.einsum("fqk,fqn->fnk", scaled, self._points.functions))
        carried = self._points.spread.summed(turned_back(self._rotations, on_facets))
        at_nodes = np.einsum("mk,mkd->md", carried, self._directions)
        return found, summed([(self._surface.blocks, at_nodes)], at_nodes.shape[1])

    def squared(self, rates: Array) -> BlockForces:
        """∫ Σ rate (v·direction)² ds, v being each bubble of a side; owned blocks. Collective.

        Args:
            rates: along the directions, (f, q, k).
        """
        return self._summed(np.einsum("fqk,fqkd->fqd", self.weights[:, :, None] * rates, self._vectors**2), 2)

    def _summed(self, vectors: Array, power: int) -> BlockForces:
        """Sums of vectors (f, q, d) times powers of both sides' bubbles, owned blocks. Collective."""
        found = []
        for sign, side, facet, shapes in self._sides():
            sums = np.zeros((side.count, vectors.shape[2]))
            for i, values in enumerate(shapes):
                np.add.at(sums, side.of_facet[facet, i], np.einsum("fq,fqd->fd", (sign * values) ** power, vectors))
            found.append((side.blocks, self._problem.domain.mesh.comm.allreduce(sums)[side.owned]))
        return summed(found, vectors.shape[2])

    def _sides(self) -> Iterator[tuple[float, SideBubbles, Integers, list[Array]]]:
        """By side: its sign, its bubbles, the facet of each intersection (f,), the bubbles at the points (f, q)."""
        points = self._points
        yield from zip((1.0, -1.0), points.sides, points.facets, points.shapes, strict=True)
