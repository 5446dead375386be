"""Corners and sizes of the facets of a boundary part, each counted on one rank."""

from __future__ import annotations

import math

import dolfinx
import numpy as np

from ..typing import Array, Entities


def owned(mesh: dolfinx.mesh.Mesh, facets: Entities) -> Entities:
    """Those of some local facets that this rank owns.

    Args:
        mesh: the mesh.
        facets: local facets (owned and ghost).
    """
    return facets[facets < mesh.topology.index_map(mesh.topology.dim - 1).size_local]


def corners(mesh: dolfinx.mesh.Mesh, facets: Entities) -> Array:
    """The vertices of facets, m, (f, d, d): by facet, vertex and coordinate.

    Args:
        mesh: of simplices.
        facets: local facets.
    """
    d = mesh.topology.dim
    if not len(facets):  # dolfinx divides by their number
        return np.empty((0, d, d))
    found = dolfinx.mesh.entities_to_geometry(mesh, d - 1, facets)
    return np.asarray(mesh.geometry.x[found][:, :, :d])


def areas(points: Array) -> Array:
    """Lengths or areas of simplices by Gram's determinant, (f,).

    Args:
        points: their vertices, (f, d, d).
    """
    edges = points[:, 1:] - points[:, :1]
    gram = np.einsum("fki,fli->fkl", edges, edges)
    return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0.0)) / math.factorial(edges.shape[1]))
