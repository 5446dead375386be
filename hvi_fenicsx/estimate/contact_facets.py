"""The facets of Γc with their nodes and bubbles, and how the directions at their nodes turn into each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..mesh import facets, nodes
from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..typing import Array, Entities, Integers
from . import bubbles


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
        local: the facets themselves, (f,).
    """

    degree: int
    nodes: Entities
    bubbles: Entities
    areas: Array
    cells: Entities
    local: Entities

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
    return ContactFacets(degree, on, found, facets.areas(points), cells, local)


def _numbers_in_cell(degree: int, cell: str) -> list[list[int]]:
    """The numbers in the cell of the bubbles of each of its facets, which lies opposite to the corner of its number."""
    everywhere = bubbles.of_cell(degree, cell)
    d = len(everywhere[0]) - 1
    within = bubbles.of_facet(degree, d)
    return [[everywhere.index((*index[:i], 0, *index[i:])) for index in within] for i in range(d + 1)]
