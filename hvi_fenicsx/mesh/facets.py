"""The facets of cells and of their copies; corners, sizes and turns of those of a boundary part."""

from __future__ import annotations

import numpy as np
from dolfinx import mesh as dmesh

from ..geometry import across, units
from ..typing import Array, Entities, Integers


def cell_facets(mesh: dmesh.Mesh) -> Entities:
    """Local facets of each local cell, shape (cells, d+1); the i-th lies opposite to the i-th vertex."""
    d = mesh.topology.dim
    mesh.topology.create_entities(d - 1)
    mesh.topology.create_connectivity(d, d - 1)
    mesh.topology.create_connectivity(d - 1, d)
    return mesh.topology.connectivity(d, d - 1).array.reshape(-1, d + 1)


def cells_of(mesh: dmesh.Mesh, facets: Entities) -> tuple[Entities, Integers]:
    """The first cell of each of some facets, and the number of the facet in it, (f,) each.

    Args:
        mesh: of simplices.
        facets: local facets.
    """
    of_cells = cell_facets(mesh)
    connected = mesh.topology.connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    cells = connected.array[connected.offsets[facets]]
    return cells, np.argmax(of_cells[cells] == facets[:, None], axis=1)


def in_copies(facets: Entities, mesh: dmesh.Mesh, cells: Entities, other: dmesh.Mesh, copies: Entities) -> Entities:
    """The facets of another mesh that are copies of some facets, sorted.

    Args:
        facets: local facets of a mesh; those of other cells than these are left out.
        mesh: the mesh.
        cells: local cells of it, (c,).
        other: the other mesh.
        copies: the local cell there that each is, its vertices in the same order, (c,).
    """
    of_cells = cell_facets(mesh)
    return np.unique(cell_facets(other)[copies][np.isin(of_cells[cells], facets)]).astype(np.int32)


def owned(mesh: dmesh.Mesh, facets: Entities) -> Entities:
    """Those of some local facets that this rank owns.

    Args:
        mesh: the mesh.
        facets: local facets (owned and ghost).
    """
    return facets[facets < mesh.topology.index_map(mesh.topology.dim - 1).size_local]


def exterior(mesh: dmesh.Mesh) -> Entities:
    """The local facets of the surface."""
    mesh.topology.create_connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    return dmesh.exterior_facet_indices(mesh.topology)


def nodes_of(mesh: dmesh.Mesh, facets: Entities) -> Entities:
    """The nodes of the geometry at the vertices of facets, (f, d).

    Args:
        mesh: of simplices.
        facets: local facets.
    """
    d = mesh.topology.dim
    if not len(facets):  # dolfinx divides by their number
        return np.empty((0, d), dtype=np.int32)
    return dmesh.entities_to_geometry(mesh, d - 1, facets)


def corners(mesh: dmesh.Mesh, facets: Entities) -> Array:
    """The vertices of facets, m, (f, d, d): by facet, vertex and coordinate.

    Args:
        mesh: of simplices.
        facets: local facets.
    """
    return mesh.geometry.x[nodes_of(mesh, facets)][:, :, : mesh.topology.dim]


def with_cells(mesh: dmesh.Mesh, facets: Entities) -> tuple[Entities, Entities, Integers]:
    """Those of some facets of the surface whose cells this rank owns, these cells, and the facets' numbers in them.

    Args:
        mesh: the mesh.
        facets: local facets (owned and ghost).
    """
    d, (cells, number) = mesh.topology.dim, cells_of(mesh, facets)
    alone = np.diff(mesh.topology.connectivity(d - 1, d).offsets)[facets] == 1
    owned = alone & (cells < mesh.topology.index_map(d).size_local)
    return facets[owned], cells[owned], number[owned]


def areas(points: Array) -> Array:
    """Lengths or areas of segments or triangles, (f,).

    Args:
        points: their vertices, (f, d, d).
    """
    return np.linalg.norm(across(points[:, 1:] - points[:, :1]), axis=1) / (points.shape[2] - 1)


def turns(mesh: dmesh.Mesh, facets: Entities) -> Array:
    """The largest angle (rad, up to a right one) between a vertex's first facet and its others, by vertex.

    Args:
        mesh: of simplices.
        facets: local facets.

    Returns:
        Of the vertices that have several of the facets, (n,).
    """
    points, d = corners(mesh, facets), mesh.topology.dim
    normals = units(across(points[:, 1:] - points[:, :1]))
    nodes = nodes_of(mesh, facets)
    _, first, vertex, count = np.unique(nodes.ravel(), return_index=True, return_inverse=True, return_counts=True)
    own = np.repeat(normals, d, axis=0)
    along = np.abs(np.sum(own * own[first][vertex], axis=1))
    least = np.ones(len(first))
    np.minimum.at(least, vertex, along)
    return np.arccos(np.minimum(least, 1.0))[count > 1]
