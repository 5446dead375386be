"""Interfaces between the nodes of both sides: relative displacements at quadrature points, tractions tested there.

It is for an interface what :class:`.contact_facets.PartTrace` is for a part of the boundary. What the first side's
nodes carry is a function of the elements' degree on its facets; a node that carries nothing has the mean of its
neighbours. What the intersections of facets say of bubbles and nodes is summed over the ranks.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from dolfinx import fem

from ...problem.contact_surface import Surface
from ...problem.problem import Problem
from ...typing import Array, Integers
from .tangent_alignment import rotations, rotations_between, turned, turned_back
from .block_forces import BlockForces, summed
from .interface_points import InterfacePoints, SideBubbles


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
