"""The facets of cells, and those of cells that are copies of others."""

from __future__ import annotations

import numpy as np
from dolfinx import mesh as dmesh

from ..typing import Entities


def cell_facets(mesh: dmesh.Mesh) -> Entities:
    """Local facets of each local cell, shape (cells, d+1); the i-th lies opposite to the i-th vertex."""
    d = mesh.topology.dim
    mesh.topology.create_entities(d - 1)
    mesh.topology.create_connectivity(d, d - 1)
    mesh.topology.create_connectivity(d - 1, d)
    return np.asarray(mesh.topology.connectivity(d, d - 1).array).reshape(-1, d + 1)


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
    on = np.zeros(of_cells.max(initial=-1) + 1, dtype=np.bool_)
    on[facets] = True
    return np.unique(cell_facets(other)[copies][on[of_cells[cells]]]).astype(np.int32)
