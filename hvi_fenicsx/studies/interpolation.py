"""P1 fields from one mesh onto the vertices of another, in the body and along Γc: exact where the meshes are nested.

Where they are not (curved boundaries, meshes made anew), a vertex outside of all cells takes its nearest cell's field,
continued linearly.
"""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from scipy import sparse

from .. import compat
from ..mesh import point_location
from ..typing import Array, Integers
from .solution_fields import PartFields, SolutionFields

_PAIRS = 4_000_000
"""Pairs of vertices and facets that are looked at together."""


def body(source: SolutionFields, points: Array) -> sparse.csr_array:
    """The matrix (m, n) from values at the vertices of a body to those at points. On this process alone.

    Args:
        source: with n vertices.
        points: m, (m, d).
    """
    d = source.points.shape[1]
    mesh = compat.simplex_mesh(MPI.COMM_SELF, source.cells, source.points, {2: "triangle", 3: "tetrahedron"}[d])
    found = mesh.topology.original_cell_index[
        point_location.containing_cells(mesh, np.pad(points, ((0, 0), (0, 3 - d))))
    ]
    corners = source.cells[found]
    return _rows(corners, point_location.barycentric_weights(source.points[corners], points), len(source.points))


def surface(source: PartFields, points: Array) -> sparse.csr_array:
    """The matrix (m, n) from values at the vertices of a part to those at points on it.

    Args:
        source: with n vertices.
        points: m, (m, d).
    """
    corners = source.points[source.facets]
    chunk = max(1, _PAIRS // len(corners))
    nearest = [_nearest(corners, points[i : i + chunk]) for i in range(0, len(points), chunk)]
    facets = np.concatenate(nearest) if nearest else np.empty(0, dtype=np.int64)
    return _rows(
        source.facets[facets],
        point_location.clipped(point_location.barycentric_weights(corners[facets], points)),
        len(source.points),
    )


def _nearest(corners: Array, points: Array) -> Integers:
    """The facet (of k, each of d corners) nearest to each point."""
    weights = point_location.clipped(point_location.barycentric_weights(corners[None], points[:, None]))
    away = np.einsum("mkc,kcd->mkd", weights, corners) - points[:, None]
    return np.asarray(np.argmin(np.einsum("mkd,mkd->mk", away, away), axis=1))


def _rows(corners: Integers, weights: Array, columns: int) -> sparse.csr_array:
    count, each = corners.shape
    starts = np.arange(0, count * each + 1, each)
    return sparse.csr_array((weights.ravel(), corners.ravel(), starts), (count, columns))
