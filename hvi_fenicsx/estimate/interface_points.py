"""Interfaces between the nodes of both sides: quadrature points on the intersections of their facets.

What the first side's nodes carry is a function of the elements' degree on its facets; a node that carries nothing has
the mean of its neighbours. What the intersections of facets say of bubbles and nodes is summed over the ranks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..mesh import nodes
from ..problem import curved_overlaps, dual_basis
from ..problem.facet_overlaps import Facets
from ..problem.interfaces import Interface
from ..problem.problem import Problem
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from .bubbles import of_facet, quadrature, shape
from .contact_facets import contact_facets


@dataclass(frozen=True, kw_only=True)
class SideBubbles:
    """The bubbles (n) of one side's facets, the same numbers on all ranks, at points of intersections (f).

    Attributes:
        comm: the ranks.
        sign: of the side's displacement in the relative one.
        shapes: the values of each bubble of a facet at the points, (f, q) each.
        facets: the facet of each intersection, (f,).
        of_facet: the bubbles of each facet (:func:`.bubbles.of_facet`), (f, k).
        count: n.
        owned: those that this rank owns, (m,).
        blocks: their local blocks, (m,).
    """

    comm: MPI.Comm
    sign: float
    shapes: list[Array]
    facets: Integers
    of_facet: Integers
    count: int
    owned: Integers
    blocks: Integers

    def values(self, e: fem.Function, dimension: int) -> Array:
        """The bubbles of each intersection's facet, (f, k, d). Collective.

        Args:
            e: all bubbles.
            dimension: of the space.
        """
        known = np.zeros((self.count, dimension))
        known[self.owned] = e.x.array.reshape(-1, dimension)[self.blocks]
        return np.asarray(self.comm.allreduce(known)[self.of_facet[self.facets]])

    def collected(self, sums: Array) -> tuple[Integers, Array]:
        """Forces (f, k, d) on them as those at owned blocks. Collective."""
        found = np.zeros((self.count, sums.shape[2]))
        np.add.at(found, self.of_facet[self.facets], sums)
        return self.blocks, self.comm.allreduce(found)[self.owned]


def _bubbles_of(
    problem: Problem, space: fem.FunctionSpace, side: Facets, name: str, sign: float, facets: Integers, at: Array
) -> SideBubbles:
    """The bubbles of a side at points (f, q, d) of its facets (f,). Collective."""
    local = contact_facets(problem, space, problem.domain.facets([name]))
    own = [_numbers(problem.space, local.nodes), _numbers(space, local.bubbles)]
    nodes_of, found = (np.concatenate(parts) for parts in zip(*agree(problem.domain.mesh.comm, own), strict=True))
    order, wanted = np.lexsort(nodes_of.T), np.lexsort(side.nodes.T)
    of_facet = np.empty((len(wanted), found.shape[1]), dtype=np.int64)
    of_facet[wanted] = found[order]
    known, numbers = np.unique(of_facet, return_inverse=True)
    start, end = space.dofmap.index_map.local_range
    owned = np.flatnonzero((known >= start) & (known < end))
    return SideBubbles(
        comm=problem.domain.mesh.comm,
        sign=sign,
        shapes=_shapes(side.degree, at),
        facets=facets,
        of_facet=numbers.reshape(of_facet.shape),
        count=len(known),
        owned=owned,
        blocks=known[owned] - start,
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
        weights: of the points, over L^(d-1), (f, q).
        facets: of the first side, (f,).
        functions: the basis functions of the first side's nodes at the points, (f, q, n).
        hats: the functions that are linear from node to node, (f, q, n).
        at_ends: the basis functions at the corners of the intersections, (f, d, n).
        normals: of the first side at the points where facets are curved, else None, (f, q, d).
        sides: the bubbles of both sides.
        reference: a node of each facet's carriers, (facets,).
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace, interface: Interface, degree: int) -> None:
        d, comm = problem.scales.dimension, problem.domain.mesh.comm
        overlaps, names = interface.overlaps, interface.sides
        own = np.arange(comm.rank, len(overlaps.areas), comm.size)
        rule, weights = quadrature("interval" if d == 2 else "triangle", degree)
        points = overlaps.sampled(rule, weights, own)
        self.weights: Array = np.asarray(points.weights.reshape(len(own), -1) / float(problem.scales.length) ** (d - 1))
        self.facets = overlaps.first[own]
        places = [on.reshape(*self.weights.shape, d) for on in (points.on_first, points.on_second)]
        first = interface.first
        normals = curved_overlaps.normals(first, points) if interface.curved else None
        self.normals = None if normals is None else normals.reshape(*self.weights.shape, d)
        self.functions, self.at_ends = first.functions(places[0]), first.functions(overlaps.on_first[own])
        self.hats = nodes.hats(first.degree, places[0].reshape(-1, d)).reshape(self.functions.shape)
        self.sides = (
            _bubbles_of(problem, bubbles, first, names.first, 1.0, self.facets, places[0]),
            _bubbles_of(problem, bubbles, interface.second, names.second, -1.0, overlaps.second[own], places[1]),
        )
        self._spread = _Spread(problem, interface)
        self.reference = self._spread.reference

    def of_nodes(self, values: Array) -> Array:
        """Values at the owned nodes (m, ...) by facet and carrier, (facets, n, ...). Collective."""
        return self._spread.of_carriers(values)

    def on_facets(self, values: Array) -> Array:
        """Values of carriers (facets, n, k) at the nodes of all facets, (facets, n, k)."""
        return np.asarray(self._spread.carriers @ values)

    def summed(self, values: Array) -> Array:
        """Forces on the functions of facets' nodes (facets, n, k) as forces on the owned nodes, (m, k). Collective."""
        return self._spread.summed(values)


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
