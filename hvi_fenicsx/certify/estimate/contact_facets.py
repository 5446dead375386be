"""The facets of Γc between their vertices: displacements at quadrature points, and tractions tested there."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import basix
import numpy as np
from dolfinx import fem

from ...mesh import facet_sizes
from ...problem.contact_surface import Surface
from ...problem.problem import Problem
from ...typing import Array, Entities
from .edge_bubbles import quadrature


@dataclass(frozen=True)
class ContactFacets:
    """Facets of Γc (f of them), each with its d vertices and its k edges between them.

    Attributes:
        vertices: their P1 blocks, (f, d).
        edges: the blocks of their edges' bubbles, (f, k).
        pairs: positions of each edge's ends in ``vertices``.
        areas: over L^(d-1), (f,).
        cells: the cells, (f,).
    """

    vertices: Entities
    edges: Entities
    pairs: Sequence[tuple[int, int]]
    areas: Array
    cells: Entities


def contact_facets(problem: Problem, bubbles: fem.FunctionSpace, local: Entities) -> ContactFacets:
    """The vertices and edges of boundary facets whose cell this rank owns.

    Args:
        problem: the mesh and its P1 vectors.
        bubbles: the space of edge bubbles.
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
    vertices = np.empty((len(local), d), dtype=np.int32)
    pairs = [(a, b) for a in range(d) for b in range(a + 1, d)]
    edges = np.empty((len(local), len(pairs)), dtype=np.int32)
    cell_edges = [tuple(e) for e in basix.topology(basix.CellType[topology.cell_name()])[1]]
    for i in range(d + 1):
        here, corners = number == i, [v for v in range(d + 1) if v != i]
        vertices[here] = problem.space.dofmap.list[cells[here]][:, corners]
        numbers = [cell_edges.index((corners[a], corners[b])) for a, b in pairs]
        edges[here] = bubbles.dofmap.list[cells[here]][:, numbers]
    points = np.asarray(problem.points[vertices] / problem.scales.length)
    return ContactFacets(vertices, edges, pairs, facet_sizes.areas(points), cells)


class PartTrace:
    """Displacements along k directions of a part, at the q quadrature points of its f facets. Creation is collective.

    Attributes:
        weights: of the points, over L^(d-1), (f, q).
    """

    def __init__(
        self, problem: Problem, bubbles: fem.FunctionSpace, surface: Surface, directions: Array, degree: int
    ) -> None:
        self._problem, self._bubbles, self._surface = problem, bubbles, surface
        d = problem.scales.dimension
        self._facets = contact_facets(problem, bubbles, surface.facets)
        each = [self._at_local_vertices(directions[:, i]) for i in range(directions.shape[1])]
        self._vectors = np.stack([n[self._facets.vertices] for n in each], axis=2)  # (f, v, k, d)
        self._barycentric, weights = quadrature("interval" if d == 2 else "triangle", degree)
        self.weights: Array = self._facets.areas[:, None] * weights

    def _at_local_vertices(self, values: Array) -> Array:
        """Values at the part's owned vertices (m, k), k ≤ d, at all local vertices (n, k). Collective."""
        field = fem.Function(self._problem.space)
        d = self._problem.scales.dimension
        field.x.array.reshape(-1, d)[self._surface.blocks, : values.shape[1]] = values
        field.x.scatter_forward()
        return np.asarray(field.x.array.reshape(-1, d)[:, : values.shape[1]])

    def at_vertices(self, values: Array) -> Array:
        """Values at the part's owned vertices (m, k) by facet, (f, d, k). Collective."""
        return np.asarray(self._at_local_vertices(values)[self._facets.vertices])

    def interpolated(self, values: Array) -> Array:
        """Linear interpolation of values at the part's owned vertices (m, k); (f, q, k). Collective."""
        return self._linear(self.at_vertices(values))

    def linear(self, u: fem.Function) -> Array:
        """The values of a P1 field, (f, q, k)."""
        blocks = u.x.array.reshape(-1, self._problem.scales.dimension)
        return self._linear(np.einsum("fvkd,fvd->fvk", self._vectors, blocks[self._facets.vertices]))

    def quadratic(self, e: fem.Function) -> Array:
        """The values of edge bubbles, (f, q, k)."""
        blocks, result = e.x.array.reshape(-1, self._problem.scales.dimension), 0.0
        for i, shape, middle in self._bubbles_of_edges():
            at = np.einsum("fkd,fd->fk", middle, blocks[self._facets.edges[:, i]])
            result = result + at[:, None, :] * shape[None, :, None]
        return np.asarray(result)

    def tested(self, tau: Array) -> tuple[Array, Array]:
        """∫ τ·v ds of tractions (f, q, k) over this rank's facets: at edges and at vertices, local blocks (n, d)."""
        d, scaled = self._problem.scales.dimension, self.weights[:, :, None] * tau
        edges, vertices = np.zeros((local_blocks(self._bubbles), d)), np.zeros((local_blocks(self._problem.space), d))
        for i in range(d):
            share = np.einsum("fqk,q->fk", scaled, self._barycentric[:, i])
            np.add.at(vertices, self._facets.vertices[:, i], np.einsum("fk,fkd->fd", share, self._vectors[:, i]))
        for i, shape, middle in self._bubbles_of_edges():
            share = np.einsum("fqk,q->fk", scaled, shape)
            np.add.at(edges, self._facets.edges[:, i], np.einsum("fk,fkd->fd", share, middle))
        return edges, vertices

    def _linear(self, values: Array) -> Array:
        return np.asarray(np.einsum("qv,fvk->fqk", self._barycentric, values))

    def _bubbles_of_edges(self) -> Iterator[tuple[int, Array, Array]]:
        """For each edge of a facet its number, its bubble at the points (q,), its directions (f, k, d)."""
        for i, (a, b) in enumerate(self._facets.pairs):
            shape = 4 * self._barycentric[:, a] * self._barycentric[:, b]
            yield i, shape, (self._vectors[:, a] + self._vectors[:, b]) / 2


def local_blocks(space: fem.FunctionSpace) -> int:
    """The number of a space's blocks on this rank, owned and ghost."""
    return int(space.dofmap.index_map.size_local + space.dofmap.index_map.num_ghosts)
