"""Γc between its nodes: displacements along some directions at quadrature points, and tractions tested there.

What the nodes of a facet carry is a function of the elements' degree on it. Quadrature points are those on the facets
of a part of the boundary, or on the intersections of two bodies' facets (:mod:`.interface_points`); there displacements
are relative ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dolfinx import fem, la

from ..mesh import nodes
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..typing import Array, Entities, Integers
from .bubbles import BlockForces, of_facet, quadrature, shape, summed
from .contact_facets import contact_facets, rotations, rotations_between, turned, turned_back
from .interface_points import InterfacePoints


@dataclass(frozen=True, kw_only=True)
class BoundaryBubbles:
    """The bubbles of a part's facets (f).

    Attributes:
        shapes: the values of each bubble of a facet at the points, (f, q) each.
        blocks: of the bubbles, local, (f, k).
    """

    shapes: list[Array]
    blocks: Entities
    sign = 1.0

    def values(self, e: fem.Function, dimension: int) -> Array:
        """The bubbles of each facet, (f, k, d).

        Args:
            e: all bubbles.
            dimension: of the space.
        """
        return np.asarray(e.x.array.reshape(-1, dimension)[self.blocks])

    def collected(self, sums: Array) -> tuple[Integers, Array]:
        """Forces (f, k, d) on them as those at local blocks."""
        return np.asarray(self.blocks.ravel(), dtype=np.int64), np.asarray(sums.reshape(-1, sums.shape[2]))


class PartPoints:
    """Quadrature points (q) on the facets (f) of a part of the boundary whose cells this rank owns.

    Args:
        problem: what was solved.
        bubbles: the space of bubbles.
        surface: the part.
        degree: of the quadrature.

    Attributes:
        weights: as of :class:`.InterfacePoints`; so are all further ones.
    """

    normals, reference = None, 0

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace, surface: Surface, degree: int) -> None:
        self._field, self._surface, d = fem.Function(problem.space), surface, problem.scales.dimension
        on = contact_facets(problem, bubbles, surface.facets)
        at, weights = quadrature("interval" if d == 2 else "triangle", degree)
        count, functions = on.nodes.shape, spaces.simplex_functions(on.degree, at, spaces.edge_share(problem.space))
        self._nodes, self.facets = on.nodes, np.arange(count[0])
        self.weights: Array = on.areas[:, None] * weights
        self.functions, self.hats, self.at_ends = (
            np.broadcast_to(values, (count[0], *values.shape))
            for values in (functions, nodes.hats(on.degree, at), np.eye(count[1]))
        )
        shapes = [np.broadcast_to(shape(index, at), self.weights.shape) for index in of_facet(on.degree, d)]
        self.sides = (BoundaryBubbles(shapes=shapes, blocks=on.bubbles),)

    def of_nodes(self, values: Array) -> Array:
        """Values at the part's owned nodes (m, ...) by facet, (f, n, ...). Collective."""
        bs, found = self._field.function_space.dofmap.index_map_bs, []
        flat = values.reshape(len(values), math.prod(values.shape[1:]))
        for start in range(0, flat.shape[1], bs):
            some, local = flat[:, start : start + bs], self._field.x.array.reshape(-1, bs)
            local[self._surface.blocks, : some.shape[1]] = some
            self._field.x.scatter_forward()
            found.append(local[self._nodes, : some.shape[1]])
        return np.concatenate(found, axis=2).reshape(*self._nodes.shape, *values.shape[1:])

    @staticmethod
    def on_facets(values: Array) -> Array:
        """Values by facet, (f, n, k), as they are."""
        return values

    def summed(self, values: Array) -> Array:
        """Forces on the functions of facets' nodes (f, n, k) as forces on the owned nodes, (m, k). Collective."""
        found = fem.Function(self._field.function_space)
        local = found.x.array.reshape(-1, found.function_space.dofmap.index_map_bs)[:, : values.shape[2]]
        np.add.at(local, self._nodes, values)
        found.x.scatter_reverse(la.InsertMode.add)
        return np.array(local[self._surface.blocks])


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

    def __init__(
        self, problem: Problem, points: PartPoints | InterfacePoints, surface: Surface, directions: Array
    ) -> None:
        self._problem, self._points = problem, points
        self._surface, self._directions, self.weights = surface, directions, points.weights
        own = points.of_nodes(directions)
        self._rotations = rotations(own, points.reference)
        self._vectors = self._turned(turned(self._rotations, own))

    def _turned(self, own: Array) -> Array:
        """Directions of nodes (facets, n, k, d) at the points, (f, q, k, d). Collective.

        On curved facets of interfaces they turn as the facets do: they are interpolated as those of one node, turned
        with the normals.
        """
        facets, normals = self._points.facets, self._points.normals
        if normals is None:
            return self._on_facets(self._points.functions, own)
        at_nodes = self._points.of_nodes(self._surface.normals)
        one = at_nodes[np.arange(len(own)), self._points.reference]
        alike = own @ rotations_between(np.broadcast_to(one[:, None], at_nodes.shape), at_nodes)
        back = rotations_between(normals, np.broadcast_to(one[facets, None], normals.shape))
        return np.asarray(self._on_facets(self._points.functions, alike) @ back)

    def interpolated(self, values: Array) -> Array:
        """The function with coefficients at the owned nodes (m, k) at the points, (f, q, k). Collective."""
        return self._on_facets(self._points.functions, self._points.of_nodes(values))

    def interpolated_components(self, values: Array) -> Array:
        """As :meth:`interpolated`, of components along the directions. Collective."""
        return self._components(self._points.functions, values)

    def at_nodes(self, values: Array) -> Array:
        """The function with coefficients at the owned nodes at the ends of facets, (f, e, k). Collective."""
        return self._on_facets(self._points.at_ends, self._points.of_nodes(values))

    def components_at_nodes(self, values: Array) -> Array:
        """As :meth:`at_nodes`, of components along the directions. Collective."""
        return self._components(self._points.at_ends, values)

    def from_node_to_node(self, values: Array) -> Array:
        """Values at the owned nodes (m, k), linear from node to node; (f, q, k). Collective."""
        return self._on_facets(self._points.hats, self._points.of_nodes(values))

    def of_field(self, u: fem.Function) -> Array:
        """The values of a displacement of the problem's space, (f, q, k). Collective."""
        return self.interpolated_components(self._along(u))

    def of_field_from_node_to_node(self, u: fem.Function) -> Array:
        """Its coefficients, linear from node to node, (f, q, k). Collective."""
        return self._components(self._points.hats, self._along(u))

    def _along(self, u: fem.Function) -> Array:
        """The coefficients of a displacement along the directions at the owned nodes, (m, k). Collective."""
        there = self._surface.values(self._problem.relative(u.x.array))
        return np.asarray(np.einsum("mkd,md->mk", self._directions, there))

    def _components(self, functions: Array, values: Array) -> Array:
        """Sums of functions (f, q, n) times components at the owned nodes (m, k). Collective."""
        return self._on_facets(functions, turned(self._rotations, self._points.of_nodes(values)))

    def _on_facets(self, functions: Array, values: Array) -> Array:
        """Sums of functions (f, q, n) times values of nodes (facets, n, k, ...)."""
        found = self._points.on_facets(values.reshape(*values.shape[:2], math.prod(values.shape[2:])))[
            self._points.facets
        ]
        return np.asarray(functions @ found).reshape(*functions.shape[:2], *values.shape[2:])

    def of_bubbles(self, e: fem.Function) -> Array:
        """The values of bubbles, (f, q, k). Collective."""
        found = np.zeros((*self.weights.shape, self._problem.scales.dimension))
        for side in self._points.sides:
            known = side.values(e, found.shape[2])
            for i, values in enumerate(side.shapes):
                found += side.sign * values[:, :, None] * known[:, i, None]
        return np.asarray(np.einsum("fqkd,fqd->fqk", self._vectors, found))

    def tested(self, tau: Array) -> tuple[BlockForces, BlockForces]:
        """∫ τ·w ds of tractions (f, q, k), against the motion of the first side: with bubbles and at nodes. Collective.

        The bubbles are those at local blocks, the nodes owned ones.
        """
        scaled = self.weights[:, :, None] * tau
        found = self._with_bubbles(np.einsum("fqk,fqkd->fqd", scaled, self._vectors), 1)
        on_facets = np.zeros(self._rotations.shape[:3])
        np.add.at(on_facets, self._points.facets, np.einsum("fqk,fqn->fnk", scaled, self._points.functions))
        carried = self._points.summed(turned_back(self._rotations, on_facets))
        at_nodes = np.einsum("mk,mkd->md", carried, self._directions)
        return found, summed([(self._surface.blocks, at_nodes)], at_nodes.shape[1])

    def squared(self, rates: Array) -> BlockForces:
        """∫ Σ rate (v·direction)² ds, v being each bubble; local blocks. Collective.

        Args:
            rates: along the directions, (f, q, k).
        """
        return self._with_bubbles(np.einsum("fqk,fqkd->fqd", self.weights[:, :, None] * rates, self._vectors**2), 2)

    def _with_bubbles(self, vectors: Array, power: int) -> BlockForces:
        """Sums of vectors (f, q, d) times powers of all bubbles, local blocks. Collective."""
        found = []
        for side in self._points.sides:
            each = [np.einsum("fq,fqd->fd", (side.sign * values) ** power, vectors) for values in side.shapes]
            found.append(side.collected(np.stack(each, axis=1)))
        return summed(found, vectors.shape[2])
