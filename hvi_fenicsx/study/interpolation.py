"""P1 fields from one mesh onto the vertices of another, in the body and along Γc: exact where the meshes are nested.

Where they are not (curved boundaries, meshes made anew), a vertex outside of all cells takes its nearest cell's field,
continued linearly.
"""

from __future__ import annotations

import dolfinx
import numpy as np
from dolfinx import geometry
from mpi4py import MPI
from scipy import sparse

from .. import compat
from .sample import Array, Indices, PartSample, Sample

_PAIRS = 4_000_000
"""Of vertices and facets that are looked at together."""


def body(source: Sample, points: Array) -> sparse.csr_array:
    """From values at the source's vertices to those at the points (m, d): a matrix (m, n). On this process alone."""
    d = source.points.shape[1]
    mesh = compat.simplex_mesh(MPI.COMM_SELF, source.cells, source.points, {2: "triangle", 3: "tetrahedron"}[d])
    found = mesh.topology.original_cell_index[_cells(mesh, np.pad(points, ((0, 0), (0, 3 - d))))]
    corners = source.cells[found]
    return _rows(corners, _weights(source.points[corners], points), len(source.points))


def _cells(mesh: dolfinx.mesh.Mesh, points: Array) -> Indices:
    """A cell that holds each point (m, 3), or the one nearest to it."""
    d = mesh.topology.dim
    tree = geometry.bb_tree(mesh, d, padding=1e-12 * float(np.ptp(mesh.geometry.x)))
    hits = geometry.compute_colliding_cells(mesh, geometry.compute_collisions_points(tree, points), points)
    counts = np.diff(hits.offsets)
    found = np.zeros(len(points), dtype=np.int64)
    found[counts > 0] = hits.array[hits.offsets[:-1][counts > 0]]
    outside = np.flatnonzero(counts == 0)
    if len(outside):
        cells = np.arange(mesh.topology.index_map(d).size_local, dtype=np.int32)
        middles = geometry.create_midpoint_tree(mesh, d, cells)
        found[outside] = geometry.compute_closest_entity(tree, middles, mesh, points[outside])
    return found


def surface(source: PartSample, points: Array) -> sparse.csr_array:
    """From values at the vertices of a part to those at the points (m, d) on it: a matrix (m, n)."""
    corners = source.points[source.facets]
    chunk = max(1, _PAIRS // len(corners))
    nearest = [_nearest(corners, points[i : i + chunk]) for i in range(0, len(points), chunk)]
    facets = np.concatenate(nearest) if nearest else np.empty(0, dtype=np.int64)
    return _rows(source.facets[facets], _inside(_weights(corners[facets], points)), len(source.points))


def _nearest(corners: Array, points: Array) -> Indices:
    """The facet (of k, each of d corners) nearest to each point."""
    weights = _inside(_weights(corners[None], points[:, None]))
    away = np.einsum("mkc,kcd->mkd", weights, corners) - points[:, None]
    return np.asarray(np.argmin(np.einsum("mkd,mkd->mk", away, away), axis=1))


def _inside(weights: Array) -> Array:
    """Barycentric weights of a point of the simplex near that of the given ones."""
    clipped = np.clip(weights, 0.0, 1.0)
    return np.asarray(clipped / clipped.sum(axis=-1, keepdims=True))


def _weights(corners: Array, points: Array) -> Array:
    """Barycentric weights (..., c) of points (..., d) in simplices (..., c, d); of their projections where c ≤ d."""
    first = corners[..., 0, :]
    edges = corners[..., 1:, :] - first[..., None, :]
    gram = np.einsum("...id,...jd->...ij", edges, edges)
    right = np.einsum("...id,...d->...i", edges, points - first)
    rest = np.einsum("...ij,...j->...i", np.linalg.inv(gram), right)
    return np.concatenate([1.0 - rest.sum(axis=-1, keepdims=True), rest], axis=-1)


def _rows(corners: Indices, weights: Array, columns: int) -> sparse.csr_array:
    count, each = corners.shape
    starts = np.arange(0, count * each + 1, each)
    return sparse.csr_array((weights.ravel(), corners.ravel(), starts), (count, columns))
