"""Fields from one mesh onto the nodes of another, in bodies and along Γc: exact where the meshes are nested.

A node takes the field of its own body: where two meet, both have cells at it.
Where they are not (curved boundaries, meshes made anew), a node outside of all cells takes its nearest cell's field,
continued.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from scipy import sparse
from scipy.sparse import csgraph

from .. import compat
from ..mesh import nodes, point_location
from ..problem import spaces
from ..typing import Array, Integers
from .solution_fields import PartFields, SolutionFields

_STEPS = 12
"""Steps to a place in a curved cell."""
_STRAIGHT = 1e-9
"""Distance of a midpoint from the middle of its edge, over the size of the cell, that is rounding."""
_PAIRS = 4_000_000
"""Pairs of vertices and facets that are looked at together."""


def bodies(source: SolutionFields, target: SolutionFields) -> sparse.csr_array:
    """The matrix (m, n) from values at the nodes of one mesh of some bodies to those of another. On this process alone.

    Args:
        source: with n nodes.
        target: with m nodes, each in a cell.
    """
    at_source, at_target = _body_of_nodes(source), _body_of_nodes(target)
    own, wanted = at_source[source.cells[:, 0]], at_target[target.cells[:, 0]]
    columns = np.empty((len(target.points), source.cells.shape[1]), dtype=np.int64)
    weights = np.empty(columns.shape)
    for number in np.unique(wanted):
        cells, there = source.cells, at_target == number
        if len(np.unique(own)) > 1:
            middles = target.points[target.corners[wanted == number]].mean(axis=1)
            cells = cells[own == np.bincount(own[_containing(source, cells, middles)]).argmax()]
        columns[there], weights[there] = _functions_at(source, cells, target.points[there])
    return _rows(columns, weights, len(source.points))


def _body_of_nodes(found: SolutionFields) -> Integers:
    """Numbers of the connected meshes that the nodes belong to, (n,)."""
    first, other = np.repeat(found.cells[:, :1], found.cells.shape[1], axis=1).ravel(), found.cells.ravel()
    size = len(found.points)
    graph = sparse.coo_array((np.ones(len(other), dtype=np.int8), (first, other)), shape=(size, size))
    return np.asarray(csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)


def _containing(source: SolutionFields, cells: Integers, points: Array) -> Integers:
    """The number of the cell, among some, that holds each point, (m,)."""
    d = source.points.shape[1]
    kept, corners = np.unique(cells[:, : d + 1], return_inverse=True)
    kind = {2: "triangle", 3: "tetrahedron"}[d]
    mesh = compat.simplex_mesh(MPI.COMM_SELF, corners.reshape(-1, d + 1), source.points[kept], kind)
    found = point_location.containing_cells(mesh, np.pad(points, ((0, 0), (0, 3 - d))))
    return np.asarray(mesh.topology.original_cell_index[found])


def _functions_at(source: SolutionFields, cells: Integers, points: Array) -> tuple[Integers, Array]:
    """The nodes of the cell, among some, that holds each point, and their functions there, (m, nodes) both."""
    d = source.points.shape[1]
    found = cells[_containing(source, cells, points)]
    weights = point_location.barycentric_weights(source.points[found[:, : d + 1]], points)
    degree = 1 if cells.shape[1] == d + 1 else 2
    if degree == 2:
        weights = _in_curved(source.points[found], points, weights)
    return found, spaces.simplex_functions(degree, weights)


@dataclass(frozen=True)
class SurfaceTransfer:
    """From the nodes of a part (n) to points on it (m).

    Attributes:
        linear: of what is linear between neighbouring nodes, as tractions are, (m, n).
        of_degree: of displacements, which have the degree of the elements, (m, n).
    """

    linear: sparse.csr_array
    of_degree: sparse.csr_array


def surface(source: PartFields, points: Array) -> SurfaceTransfer:
    """From the nodes of a part to points on it.

    Args:
        source: the part.
        points: m, (m, d).
    """
    facets = _facets_near(source, points)
    linear = source.facets[facets], _weights(source.points[source.facets[facets]], points)
    transfer = _rows(*linear, len(source.points))
    if not len(source.quadratic):
        return SurfaceTransfer(transfer, transfer)
    parts = len(nodes.parts(source.quadratic[:1]))
    there = np.flatnonzero(facets < parts * len(source.quadratic))
    whole = source.quadratic[facets[there] // parts]
    pad = ((0, 0), (0, whole.shape[1] - points.shape[1]))
    columns, weights = np.pad(linear[0], pad), np.pad(linear[1], pad)
    columns[there] = whole
    corners = source.points[whole[:, : points.shape[1]]]
    inside = _in_curved(source.points[whole], points[there], _weights(corners, points[there]))
    weights[there] = spaces.simplex_functions(2, inside)
    return SurfaceTransfer(transfer, _rows(columns, weights, len(source.points)))


def _in_curved(cells: Array, points: Array, weights: Array) -> Array:
    """The places of points in cells or facets with curved edges, from those in straight ones; barycentric, (m, c).

    What is left of the way to a point is gone in the straight cell again and again. Each step gains the cell's bend.

    Args:
        cells: the nodes of the cell of each point, m, (m, n, d).
        points: m, (m, d).
        weights: in the straight cell, (m, c).
    """
    corners = cells[:, : weights.shape[1]]
    sizes = np.ptp(corners, axis=1).max(axis=1)
    straight = nodes.middles(corners)
    bent = np.flatnonzero(np.abs(cells[:, weights.shape[1] :] - straight).max(axis=(1, 2)) > _STRAIGHT * sizes)
    found, place = weights.copy(), weights[bent]
    for _ in range(_STEPS):
        reached = np.einsum("mn,mnd->md", spaces.simplex_functions(2, place), cells[bent])
        wanted, now = (point_location.barycentric_weights(corners[bent], x) for x in (points[bent], reached))
        place = place + wanted - now
    found[bent] = place
    return found


def _facets_near(source: PartFields, points: Array) -> Integers:
    """The facet nearest to each point."""
    corners = source.points[source.facets]
    chunk = max(1, _PAIRS // len(corners))
    nearest = [_nearest(corners, points[i : i + chunk]) for i in range(0, len(points), chunk)]
    return np.concatenate(nearest) if nearest else np.empty(0, dtype=np.int64)


def _weights(corners: Array, points: Array) -> Array:
    return point_location.clipped(point_location.barycentric_weights(corners, points))


def _nearest(corners: Array, points: Array) -> Integers:
    """The facet (of k, each of d corners) nearest to each point."""
    weights = point_location.clipped(point_location.barycentric_weights(corners[None], points[:, None]))
    away = np.einsum("mkc,kcd->mkd", weights, corners) - points[:, None]
    return np.asarray(np.argmin(np.einsum("mkd,mkd->mk", away, away), axis=1))


def _rows(corners: Integers, weights: Array, columns: int) -> sparse.csr_array:
    count, each = corners.shape
    starts = np.arange(0, count * each + 1, each)
    return sparse.csr_array((weights.ravel(), corners.ravel(), starts), (count, columns))
