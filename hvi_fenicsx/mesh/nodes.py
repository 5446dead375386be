"""The nodes of a space of degree 1 or 2 on simplices: the vertices, and at degree 2 the midpoints of the edges.

Nodes are numbered as the (block) dofs of the space. Cells and facets whose corners are all nodes (``linear_cells``,
``linear_facets``) are those of the mesh at degree 1, and of the once refined mesh at degree 2.
"""

from __future__ import annotations

from typing import Any

import basix
import numpy as np
import numpy.typing as npt
from dolfinx import fem
from dolfinx import mesh as dmesh

from .. import compat
from ..typing import Array, Entities
from .facets import cells_of

_SPLIT: dict[int, tuple[tuple[int, ...], ...]] = {
    2: ((0, 2), (2, 1)),
    3: ((0, 5, 4), (5, 1, 3), (4, 3, 2), (3, 4, 5)),
    4: (
        (0, 9, 8, 7),
        (9, 1, 6, 5),
        (8, 6, 2, 4),
        (7, 5, 4, 3),
        (9, 8, 7, 4),
        (9, 6, 8, 4),
        (9, 5, 6, 4),
        (9, 7, 5, 4),
    ),
}
"""The parts of a simplex with so many corners by its nodes: corners, then midpoints of edges in the order of basix."""
_CORNERS = {3: 2, 6: 3, 10: 4}
"""The number of corners of a simplex by that of its nodes."""
KINDS = {2: basix.CellType.interval, 3: basix.CellType.triangle, 4: basix.CellType.tetrahedron}
"""Simplices by their number of corners."""


def degree(space: fem.FunctionSpace) -> int:
    """The degree of a space, 1 or 2."""
    return 1 if space.dofmap.list.shape[1] == space.mesh.topology.dim + 1 else 2


def count(mesh: dmesh.Mesh, degree: int) -> int:
    """The number of nodes on all ranks. Collective.

    Args:
        mesh: of simplices.
        degree: 1 or 2.
    """
    mesh.topology.create_entities(degree - 1)
    return sum(int(mesh.topology.index_map(dimension).size_global) for dimension in range(degree))


def points(space: fem.FunctionSpace) -> Array:
    """The local nodes (owned and ghost), m, (n, 3).

    ``tabulate_dof_coordinates`` maps each from each of its cells, four times as slowly.
    """
    corners = _cells(space)[:, : space.dofmap.list.shape[1]]  # curved cells have nodes of degree 2
    dofs, vertices = space.dofmap.list[: len(corners)], corners.shape[1]
    index_map = space.dofmap.index_map
    size = index_map.size_local + index_map.num_ghosts
    node = np.zeros(size, dtype=np.int32)
    node[dofs[:, :vertices]] = corners
    x = space.mesh.geometry.x
    found = x[node]
    for number, (a, b) in enumerate(edges(vertices) if dofs.shape[1] > vertices else ()):
        found[dofs[:, vertices + number]] = (x[corners[:, a]] + x[corners[:, b]]) / 2
    return found


def _cells(space: fem.FunctionSpace) -> Entities:
    """The local cells by the nodes of their geometry."""
    count = space.mesh.topology.index_map(space.mesh.topology.dim)
    return compat.geometry_dofmap(space.mesh)[: count.size_local + count.num_ghosts]


def reference_points(space: fem.FunctionSpace) -> Array:
    """The nodes of a cell by their barycentric coordinates, in the order of its dofs, (nodes, d+1)."""
    corners = np.eye(space.mesh.topology.dim + 1)
    middles = [corners[list(ends)].mean(axis=0) for ends in (edges(len(corners)) if degree(space) == 2 else ())]
    return np.vstack([corners, *middles])


def dof_of_node(space: fem.FunctionSpace) -> Entities:
    """The (block) dof at each geometry node of the mesh, whose nodes are its vertices, (nodes,)."""
    corners = _cells(space)
    result = np.zeros(space.mesh.geometry.x.shape[0], dtype=np.int32)
    result[corners] = space.dofmap.list[: len(corners), : corners.shape[1]]
    return result


def edge_ends(space: fem.FunctionSpace) -> Entities:
    """The vertices whose middle each local node is, by their numbers, (n, 2): a vertex is named twice."""
    index_map = space.dofmap.index_map
    return ends_of(space.dofmap.list, index_map.size_local + index_map.num_ghosts, space.mesh.topology.dim)


def ends_of(cells: npt.NDArray[Any], count: int, dimension: int) -> Entities:
    """The vertices whose middle each node of a mesh is, (count, 2): a vertex is named twice.

    Args:
        cells: by their nodes, corners first, (c, nodes).
        count: of nodes.
        dimension: of the cells.
    """
    found = np.repeat(np.arange(count, dtype=np.int32)[:, None], 2, axis=1)
    for node, ends in zip(cells.T[dimension + 1 :], edges(dimension + 1), strict=False):
        found[node] = cells[:, list(ends)]
    return found


def middles(corners: Array) -> Array:
    """The middles of the edges of cells or facets, in the order of their nodes, (c, edges, d).

    Args:
        corners: (c, corners, d).
    """
    return corners[:, np.array(edges(corners.shape[1]))].mean(axis=2)


def owned_cells(space: fem.FunctionSpace) -> Entities:
    """The cells that this rank owns, by their nodes, (c, nodes)."""
    topology = space.mesh.topology
    return space.dofmap.list[: topology.index_map(topology.dim).size_local]


def linear_cells(space: fem.FunctionSpace) -> Entities:
    """The parts of the cells that this rank owns, by their nodes, (c, d+1); those of a cell follow one another."""
    own = owned_cells(space)
    return own if degree(space) == 1 else parts(own)


def parts_of_cell(space: fem.FunctionSpace) -> int:
    """How many of ``linear_cells`` a cell has."""
    return 1 if degree(space) == 1 else len(_SPLIT[space.mesh.topology.dim + 1])


def middles_of_parts(space: fem.FunctionSpace) -> Array:
    """The middles of the ``linear_cells`` of a cell by their barycentric coordinates, (parts, d+1)."""
    points = reference_points(space)
    own = np.arange(len(points))[None]
    return points[own if degree(space) == 1 else parts(own)].mean(axis=1)


def linear_facets(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """The parts of local facets by their nodes, (k, d); those of a facet follow one another.

    Args:
        space: of degree 1 or 2.
        facets: local facets.
    """
    own = facet_nodes(space, facets)
    return own if degree(space) == 1 else parts(own)


def hats(degree: int, barycentric: Array) -> Array:
    """The functions that are 1 at a node of a facet and linear in its parts, at points, (q, nodes).

    Args:
        degree: 1 or 2.
        barycentric: the points, (q, corners).
    """
    if degree == 1:
        return barycentric
    corners = np.maximum(2 * barycentric - 1, 0.0)
    ends = [2 * barycentric[:, pair] for pair in edges(barycentric.shape[1])]
    middles = [np.minimum(both.min(axis=1), both.sum(axis=1) - 1) for both in ends]
    return np.column_stack([corners, *(np.maximum(middle, 0.0) for middle in middles)])


def facet_nodes(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """The nodes of local facets: corners, then midpoints of edges in the order of basix, (k, nodes).

    Args:
        space: of degree 1 or 2.
        facets: local facets.
    """
    layout, d = space.dofmap.dof_layout, space.mesh.geometry.dim
    cells, local = cells_of(space.mesh, facets)
    table = np.array([layout.entity_closure_dofs(d - 1, i) for i in range(d + 1)], dtype=np.int32)
    return np.take_along_axis(space.dofmap.list[cells], table[local], axis=1)


def parts(cells: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The parts (k, corners) of cells or facets of degree 2; those of one follow one another.

    Args:
        cells: by their nodes, corners first, then midpoints of edges in the order of basix, (c, nodes).
    """
    table = np.array(_SPLIT[_CORNERS[cells.shape[1]]])
    return np.ascontiguousarray(cells[:, table].reshape(-1, table.shape[1]))


def joined(found: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The cells or facets of degree 2 by their nodes (c, nodes), of which :func:`parts` gives these (k, corners)."""
    table = np.array(_SPLIT[found.shape[1]])
    grouped = found.reshape(-1, *table.shape)
    first = [np.argwhere(table == node)[0] for node in range(table.max() + 1)]
    return np.stack([grouped[:, row, column] for row, column in first], axis=1)


def to_barycentric(local: Array) -> Array:
    """Reference coordinates of points in a simplex (..., k) as barycentric ones, (..., k+1)."""
    return np.concatenate([1.0 - local.sum(axis=-1, keepdims=True), local], axis=-1)


def quadrature(corners: int, degree: int) -> tuple[Array, Array]:
    """Barycentric points (q, corners) and weights (q,), whose sum is 1, of a simplex.

    Args:
        corners: how many it has.
        degree: of the polynomials that are integrated exactly.
    """
    made: tuple[Any, Any] = basix.make_quadrature(KINDS[corners], degree)
    points, weights = made
    return to_barycentric(points), weights / weights.sum()


def edges(corners: int) -> list[list[int]]:
    """The edges of a simplex by its corners, in the order of their midpoints.

    Args:
        corners: how many it has.
    """
    found: list[list[int]] = basix.topology(KINDS[corners])[1]
    return found


def lagrange(corners: int, degree: int) -> basix.finite_element.FiniteElement:
    """The Lagrange element on a simplex.

    Args:
        corners: how many it has.
        degree: of the element.
    """
    return basix.create_element(basix.ElementFamily.P, KINDS[corners], degree, basix.LagrangeVariant.gll_warped)
