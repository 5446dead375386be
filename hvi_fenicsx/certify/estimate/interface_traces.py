"""Interfaces between the vertices of both sides: relative displacements at quadrature points, tractions tested there.

It is for an interface what :class:`.contact_facets.PartTrace` is for a part of the boundary. What the first side's
vertices carry is linear on its facets; a vertex that carries nothing has the mean of its neighbours. The intersections
of facets are spread over the ranks; what they say of edges and vertices is summed over all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ...problem import dual_basis
from ...problem.contact_surface import Surface
from ...problem.facet_overlaps import Facets
from ...problem.interfaces import Interface
from ...problem.problem import Problem
from ...typing import Array, Integers
from .bubbles import quadrature
from .contact_facets import contact_facets, local_blocks


@dataclass(frozen=True, kw_only=True)
class _SideEdges:
    """The bubbles on the edges (n) of one side, the same numbers on all ranks.

    Attributes:
        of_facet: the edges of each facet, (f, pairs).
        here: edges that this rank has, (k,).
        blocks: their local bubbles, (k,).
        ranks: how many ranks have each edge, (n,).
    """

    of_facet: Integers
    here: Integers
    blocks: Integers
    ranks: Integers


def _edges(problem: Problem, bubbles: fem.FunctionSpace, facets: Facets, side: str) -> _SideEdges:
    """The edges of a side. Collective."""
    size, comm = problem.space.dofmap.index_map.size_global, problem.domain.mesh.comm
    known, of_facet = np.unique(_keys(facets.vertices, size), return_inverse=True)
    local = contact_facets(problem, bubbles, problem.domain.facets([side]))
    numbers = problem.space.dofmap.index_map.local_to_global(local.nodes.ravel()).reshape(local.nodes.shape)
    here = np.searchsorted(known, _keys(numbers.astype(np.int64), size).ravel())
    here, first = np.unique(here, return_index=True)
    ranks = np.zeros(len(known), dtype=np.int64)
    ranks[here] = 1
    return _SideEdges(
        of_facet=of_facet.reshape(len(facets.vertices), -1),
        here=here,
        blocks=local.bubbles.ravel()[first].astype(np.int64),
        ranks=comm.allreduce(ranks),
    )


def _keys(vertices: Integers, size: int) -> Integers:
    """A number for each edge of facets with these vertices (f, d), (f, pairs)."""
    ends = [np.sort(vertices[:, pair], axis=1) for pair in _pairs(vertices.shape[1])]
    return np.stack([end[:, 0] * size + end[:, 1] for end in ends], axis=1)


def _pairs(corners: int) -> list[list[int]]:
    return [list(pair) for pair in combinations(range(corners), 2)]


class InterfacePoints:
    """Quadrature points (q) on the intersections (f) that this rank looks at. Creation is collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        interface: one of the problem's.
        degree: of the quadrature.

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
        facets: of the first side and of the second, (f,) each.
        places: barycentric coordinates of the points in these, (f, q, d) each.
        corners: of the intersections in the first side's facets, (f, d, d).
        sides: the edges of both sides.
        spread: what the first side's vertices carry, on its facets.
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace, interface: Interface, degree: int) -> None:
        d, comm = problem.scales.dimension, problem.domain.mesh.comm
        overlaps, names = interface.overlaps, interface.sides
        own = np.arange(comm.rank, len(overlaps.areas), comm.size)
        rule, weights = quadrature("interval" if d == 2 else "triangle", degree)
        self.weights: Array = overlaps.areas[own, None] / problem.scales.length ** (d - 1) * weights
        self.facets = overlaps.first[own], overlaps.second[own]
        self.places = rule @ overlaps.on_first[own], rule @ overlaps.on_second[own]
        self.corners = overlaps.on_first[own]
        self.sides = (
            _edges(problem, bubbles, interface.first, names.first),
            _edges(problem, bubbles, interface.second, names.second),
        )
        self.spread = _Spread(problem, interface)


class InterfaceTrace:
    """Relative displacements of an interface along k directions, at quadrature points. Creation is collective.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        points: of the interface.
        surface: the vertices of its first side.
        directions: at these, (m, k, d).

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
    """

    def __init__(
        self, problem: Problem, bubbles: fem.FunctionSpace, points: InterfacePoints, surface: Surface, directions: Array
    ) -> None:
        self._problem, self._bubbles, self._points = problem, bubbles, points
        self._surface, self._directions, self.weights = surface, directions, points.weights
        vectors = self.interpolated(directions.reshape(len(directions), -1))
        self._vectors = vectors.reshape(*self.weights.shape, *directions.shape[1:])

    def interpolated(self, values: Array) -> Array:
        """Values at the owned vertices (m, k) at the points, linear between them, (f, q, k). Collective."""
        return np.asarray(self._points.places[0] @ self._points.spread.at_corners(values)[self._points.facets[0]])

    def at_nodes(self, values: Array) -> Array:
        """Values at the owned vertices (m, k) at the corners of the intersections, (f, d, k). Collective."""
        return np.asarray(self._points.corners @ self._points.spread.at_corners(values)[self._points.facets[0]])

    def from_node_to_node(self, values: Array) -> Array:
        """The same: interfaces are of degree 1. Collective."""
        return self.interpolated(values)

    def of_field(self, u: fem.Function) -> Array:
        """The relative values of a P1 field, (f, q, k). Collective."""
        there = self._surface.values(self._problem.relative(u.x.array))
        return self.interpolated(np.einsum("mkd,md->mk", self._directions, there))

    def of_field_from_node_to_node(self, u: fem.Function) -> Array:
        """The same: interfaces are of degree 1. Collective."""
        return self.of_field(u)

    def of_bubbles(self, e: fem.Function) -> Array:
        """The relative values of edge bubbles, (f, q, k). Collective."""
        found = np.zeros((*self.weights.shape, self._problem.scales.dimension))
        blocks = e.x.array.reshape(-1, found.shape[2])
        for sign, side, edges, shape in self._bubbles_of_edges():
            known = np.zeros((len(side.ranks), found.shape[2]))
            known[side.here] = blocks[side.blocks]
            known = self._problem.domain.mesh.comm.allreduce(known) / side.ranks[:, None]
            found += sign * shape[:, :, None] * known[edges][:, None]
        return np.asarray(np.einsum("fqkd,fqd->fqk", self._vectors, found))

    def tested(self, tau: Array) -> tuple[Array, Array]:
        """∫ τ·w ds of tractions (f, q, k): at the edges of both sides and at vertices, local blocks (n, d). Collective.

        Args:
            tau: against the motion of the first side.
        """
        d = self._problem.scales.dimension
        scaled = self.weights[:, :, None] * tau
        vectors = np.einsum("fqk,fqkd->fqd", scaled, self._vectors)
        edges, vertices = np.zeros((local_blocks(self._bubbles), d)), np.zeros((local_blocks(self._problem.space), d))
        for sign, side, numbers, shape in self._bubbles_of_edges():
            sums = np.zeros((len(side.ranks), d))
            np.add.at(sums, numbers, sign * np.einsum("fq,fqd->fd", shape, vectors))
            sums = self._problem.domain.mesh.comm.allreduce(sums) / side.ranks[:, None]
            np.add.at(edges, side.blocks, sums[side.here])
        corners = np.zeros((len(self._points.spread.carriers), d, scaled.shape[2]))
        np.add.at(corners, self._points.facets[0], np.einsum("fqk,fqv->fvk", scaled, self._points.places[0]))
        at = self._points.spread.summed(corners)
        vertices[self._surface.blocks] = np.einsum("mk,mkd->md", at, self._directions)
        return edges, vertices

    def _bubbles_of_edges(self) -> Iterator[tuple[float, _SideEdges, Integers, Array]]:
        """By side and edge: the sign, the side, the edge's number by facet (f,), its bubbles at the points (f, q)."""
        points = self._points
        for sign, side, facet, at in zip((1.0, -1.0), points.sides, points.facets, points.places, strict=True):
            for i, (a, b) in enumerate(_pairs(at.shape[2])):
                yield sign, side, side.of_facet[facet, i], 4 * at[:, :, a] * at[:, :, b]


class _Spread:
    """Values at the vertices that carry something as values at the corners of the first side's facets.

    Attributes:
        carriers: which vertices (numbered through) the value at each corner is the mean of, rows of weights.
    """

    def __init__(self, problem: Problem, interface: Interface) -> None:
        self._comm: MPI.Comm = problem.domain.mesh.comm
        first, weights = interface.first, interface.rows.weights
        start = problem.space.dofmap.index_map.local_range[0]
        own = start + interface.surface.blocks.astype(np.int64)
        known = np.flatnonzero(weights > 0.0)
        self._count, self._own = len(known), np.searchsorted(known, own)
        kept = weights[first.vertices] > 0.0
        at = np.searchsorted(known, first.vertices).clip(max=len(known) - 1)
        d = kept.shape[1]
        self.carriers = np.zeros((len(kept), d, d))
        self._at = np.where(kept, at, 0)
        for corner in range(d):
            alone = kept[:, corner]
            shares = kept / np.maximum(kept.sum(axis=1, keepdims=True), 1)
            self.carriers[:, corner] = np.where(alone[:, None], np.eye(d)[corner], shares)
        for facet, vertex in dual_basis.adopted(first, interface.overlaps, kept).items():
            self._at[facet, 0], self.carriers[facet, :, 0] = np.searchsorted(known, vertex), 1.0

    def at_corners(self, values: Array) -> Array:
        """Values at the owned vertices (m, k) at the corners of all facets, (facets, d, k). Collective."""
        every = np.zeros((self._count, values.shape[1]))
        every[self._own] = values
        return np.asarray(self.carriers @ self._comm.allreduce(every)[self._at])

    def summed(self, corners: Array) -> Array:
        """Values at the corners of facets (facets, d, k) summed at the owned vertices, (m, k). Collective."""
        every = np.zeros((self._count, corners.shape[2]))
        np.add.at(every, self._at, self.carriers.transpose(0, 2, 1) @ corners)
        return np.asarray(self._comm.allreduce(every)[self._own])
