"""The facets of Γc between their nodes: displacements at quadrature points, and tractions tested there."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..mesh import facets, nodes
from ..problem import spaces
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..typing import Array, Entities, Integers
from . import bubbles
from .bubbles import BlockForces, summed


def rotations(directions: Array, reference: Integers | int = 0) -> Array:
    """Matrices R of the nodes of facets, (f, n, k, k).

    Components c along a node's directions are Rᵀc along those of one node of the facet. Only tangents are turned, the
    last d - 1 directions at most; a normal stays the node's own.

    Args:
        directions: of the nodes of facets, unit vectors, (f, n, k, d).
        reference: the node of each facet whose tangents the others get, (f,), or the same for all.
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
    return np.asarray(np.einsum("fnkl,fnk...->fnl...", rotations, values))


def turned_back(rotations: Array, values: Array) -> Array:
    """The components along each node's own directions, (f, n, k).

    Args:
        rotations: R, (f, n, k, k).
        values: the components along the directions of one node of each facet, (f, n, k).
    """
    return np.asarray(np.einsum("fnkl,fnl->fnk", rotations, values))


def frames(surface: Surface) -> Array:
    """Normal and tangents of the nodes of a part, (m, d, d).

    Args:
        surface: the part.
    """
    return np.concatenate([surface.normals[:, None], surface.tangents], axis=1)


def rotations_between(one: Array, other: Array) -> Array:
    """The rotations that take unit vectors to others the shortest way, (..., d, d); these must not be opposite.

    Args:
        one: unit vectors, (..., d).
        other: unit vectors, (..., d).
    """
    both, cosine = one + other, np.sum(one * other, axis=-1)[..., None, None]
    bent = both[..., :, None] * both[..., None, :] / (1.0 + cosine)
    return np.asarray(np.eye(one.shape[-1]) - bent + 2.0 * other[..., :, None] * one[..., None, :])


@dataclass(frozen=True)
class ContactFacets:
    """Facets of Γc (f of them), each with its n nodes, corners first, and its k bubbles (:func:`.bubbles.of_facet`).

    Attributes:
        degree: of the solution.
        nodes: their blocks, (f, n).
        bubbles: the blocks of their bubbles, (f, k).
        areas: over L^(d-1), (f,).
        cells: the cells, (f,).
    """

    degree: int
    nodes: Entities
    bubbles: Entities
    areas: Array
    cells: Entities

    @property
    def dimension(self) -> int:
        """The dimension of space, which is the number of a facet's corners."""
        return self.nodes.shape[1] if self.degree == 1 else {3: 2, 6: 3}[self.nodes.shape[1]]

    @property
    def corners(self) -> Entities:
        """The blocks of the corners, (f, d)."""
        return self.nodes[:, : self.dimension]


def contact_facets(problem: Problem, space: fem.FunctionSpace, local: Entities) -> ContactFacets:
    """The nodes and bubbles of boundary facets whose cell this rank owns.

    Args:
        problem: the mesh and its displacements.
        space: of bubbles.
        local: the local facets.
    """
    topology, d = problem.domain.mesh.topology, problem.scales.dimension
    topology.create_connectivity(d - 1, d)
    topology.create_connectivity(d, d - 1)
    of_facet, of_cell = topology.connectivity(d - 1, d), topology.connectivity(d, d - 1)
    cells = of_facet.array[of_facet.offsets[local]]
    owned = cells < topology.index_map(d).size_local
    cells, local = cells[owned], local[owned]
    number = np.argmax(of_cell.array.reshape(-1, d + 1)[cells] == local[:, None], axis=1)
    degree, on = nodes.degree(problem.space), nodes.facet_nodes(problem.space, local)
    table = np.array(_numbers_in_cell(degree, topology.cell_name()), dtype=np.int32)
    found = np.take_along_axis(space.dofmap.list[cells], table[number], axis=1)
    points = np.asarray(problem.points[on[:, :d]] / problem.scales.length)
    return ContactFacets(degree, on, found, facets.areas(points), cells)


def _numbers_in_cell(degree: int, cell: str) -> list[list[int]]:
    """The numbers in the cell of the bubbles of each of its facets, which lies opposite to the corner of its number."""
    everywhere = bubbles.of_cell(degree, cell)
    d = len(everywhere[0]) - 1
    within = bubbles.of_facet(degree, d)
    return [[everywhere.index((*index[:i], 0, *index[i:])) for index in within] for i in range(d + 1)]


class PartTrace:
    """Displacements along k directions of a part, at the q quadrature points of its f facets. Creation is collective.

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
    """

    def __init__(
        self, problem: Problem, space: fem.FunctionSpace, surface: Surface, directions: Array, degree: int
    ) -> None:
        self._problem, self._surface = problem, surface
        d = problem.scales.dimension
        self._facets = contact_facets(problem, space, surface.facets)
        each = [self._at_local_nodes(directions[:, i]) for i in range(directions.shape[1])]
        own = np.stack([n[self._facets.nodes] for n in each], axis=2)  # (f, n, k, d)
        self._rotations = rotations(own)
        self._vectors = turned(self._rotations, own)
        self._barycentric, weights = bubbles.quadrature("interval" if d == 2 else "triangle", degree)
        self._functions = self._functions_at(self._barycentric)
        self.weights: Array = self._facets.areas[:, None] * weights

    def _functions_at(self, barycentric: Array) -> Array:
        """The displacements' basis functions at points of a facet, (q, n)."""
        return spaces.simplex_functions(self._facets.degree, barycentric, spaces.edge_share(self._problem.space))

    def _at_local_nodes(self, values: Array) -> Array:
        """Values at the part's owned nodes (m, k), k ≤ d, at all local nodes (n, k). Collective."""
        field = fem.Function(self._problem.space)
        d = self._problem.scales.dimension
        field.x.array.reshape(-1, d)[self._surface.blocks, : values.shape[1]] = values
        field.x.scatter_forward()
        return np.asarray(field.x.array.reshape(-1, d)[:, : values.shape[1]])

    def at_nodes(self, values: Array) -> Array:
        """Values at the part's owned nodes (m, k) by facet, (f, n, k). Collective."""
        return np.asarray(self._at_local_nodes(values)[self._facets.nodes])

    def components_at_nodes(self, values: Array) -> Array:
        """Components along the directions at the part's owned nodes (m, k) by facet, (f, n, k). Collective."""
        return turned(self._rotations, self.at_nodes(values))

    def interpolated(self, values: Array) -> Array:
        """The function with coefficients at the part's owned nodes (m, k); (f, q, k). Collective."""
        return self._combined(self._functions, self.at_nodes(values))

    def interpolated_components(self, values: Array) -> Array:
        """As :meth:`interpolated`, of components along the directions. Collective."""
        return self._combined(self._functions, self.components_at_nodes(values))

    def from_node_to_node(self, values: Array) -> Array:
        """Values at the part's owned nodes (m, k), linear from node to node; (f, q, k). Collective."""
        return self._combined(self._hats, self.at_nodes(values))

    def of_field(self, u: fem.Function) -> Array:
        """The values of a displacement of the problem's space, (f, q, k)."""
        return self._combined(self._functions, self._along(u))

    def of_field_from_node_to_node(self, u: fem.Function) -> Array:
        """The coefficients of a displacement of the problem's space, linear from node to node; (f, q, k)."""
        return self._combined(self._hats, self._along(u))

    def of_bubbles(self, e: fem.Function) -> Array:
        """The values of bubbles, (f, q, k)."""
        blocks, result = e.x.array.reshape(-1, self._problem.scales.dimension), 0.0
        for i, shape, middle in self._bubbles_of_facet:
            at = np.einsum("fkd,fd->fk", middle, blocks[self._facets.bubbles[:, i]])
            result = result + at[:, None, :] * shape[None, :, None]
        return np.asarray(result)

    def tested(self, tau: Array) -> tuple[BlockForces, BlockForces]:
        """∫ τ·v ds of tractions (f, q, k) over this rank's facets: with bubbles and at nodes, local blocks."""
        d, scaled, at_nodes = self._problem.scales.dimension, self.weights[:, :, None] * tau, []
        for i in range(self._functions.shape[1]):
            share = np.einsum("fqk,q->fk", scaled, self._functions[:, i])
            at_nodes.append((self._facets.nodes[:, i], np.einsum("fk,fkd->fd", share, self._vectors[:, i])))
        return self._with_bubbles(scaled, 1), summed(at_nodes, d)

    def squared(self, rates: Array) -> BlockForces:
        """∫ Σ rate (v·direction)² ds over this rank's facets, v being each bubble; local blocks.

        Args:
            rates: along the directions, (f, q, k).
        """
        return self._with_bubbles(self.weights[:, :, None] * rates, 2)

    def _with_bubbles(self, scaled: Array, power: int) -> BlockForces:
        """Sums over the points of weights (f, q, k) times powers of each bubble along the directions."""
        found = []
        for i, shape, middle in self._bubbles_of_facet:
            share = np.einsum("fqk,q->fk", scaled, shape**power)
            found.append((self._facets.bubbles[:, i], np.einsum("fk,fkd->fd", share, middle**power)))
        return summed(found, self._problem.scales.dimension)

    def _along(self, u: fem.Function) -> Array:
        """The coefficients of a displacement along the directions by facet, (f, n, k)."""
        blocks = u.x.array.reshape(-1, self._problem.scales.dimension)
        return np.asarray(np.einsum("fnkd,fnd->fnk", self._vectors, blocks[self._facets.nodes]))

    @staticmethod
    def _combined(functions: Array, values: Array) -> Array:
        return np.asarray(np.einsum("qn,fnk->fqk", functions, values))

    @functools.cached_property
    def _hats(self) -> Array:
        """At the points, the functions that are linear from node to node, (q, n)."""
        return nodes.hats(self._facets.degree, self._barycentric)

    @functools.cached_property
    def _bubbles_of_facet(self) -> list[tuple[int, Array, Array]]:
        """For each bubble of a facet its number, its values at the points (q,), its directions (f, k, d)."""
        found = []
        for i, index in enumerate(bubbles.of_facet(self._facets.degree, self._facets.dimension)):
            at = self._functions_at(np.array([index]) / sum(index))[0]
            middle = np.einsum("n,fnkd->fkd", at, self._vectors)
            found.append((i, bubbles.shape(index, self._barycentric), middle))
        return found
