"""Where a mesh is folded, and which facets of second order are curved or turn back. Light: gmsh's own process uses it.

A mesh is folded where two cells lie on the same side of their common facet, or the cells about a vertex overlap. The
order in which a file lists the vertices of a cell is no fold. Two bodies that lie on each other are none either.
"""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np

from ..typing import Array, Integers, Mask
from .thresholds import ROUNDING

_ROUNDING = 1e-6
"""Part of the full angle that rounding may add."""


def folded_cells(points: Array, cells: Integers) -> Integers:
    """The cells at a fold, one or two of each; empty where the mesh has none.

    Args:
        points: the vertices, (n, d).
        cells: the vertices of each simplex, (c, d+1).
    """
    return np.union1d(_over_facets(points, cells), _around_vertices(points, cells))


def _over_facets(points: Array, cells: Integers) -> Integers:
    """The pairs of cells that lie on the same side of their common facet."""
    d = cells.shape[1] - 1
    kept = [list(others) for others in combinations(range(d + 1), d)]
    facets = np.sort(np.concatenate([cells[:, others] for others in kept]), axis=1)
    opposite = np.concatenate([cells[:, next(iter(set(range(d + 1)) - set(others)))] for others in kept])
    edges = points[np.column_stack([facets[:, 1:], opposite])] - points[facets[:, :1]]
    side = np.sign(_volumes(edges))
    order = np.lexsort(facets.T)
    same = np.all(facets[order[1:]] == facets[order[:-1]], axis=1) & (side[order[1:]] == side[order[:-1]])
    return np.concatenate([order[1:][same], order[:-1][same]]) % len(cells)


def _around_vertices(points: Array, cells: Integers) -> Integers:
    """A cell of each vertex about which the cells fill more than the full angle."""
    angles = np.column_stack([_angles(points, np.roll(cells, -i, axis=1)) for i in range(cells.shape[1])])
    total = np.bincount(cells.ravel(), weights=angles.ravel(), minlength=len(points))
    full = 2.0 * math.pi * (cells.shape[1] - 2)
    over: Mask = total > full * (1.0 + _ROUNDING)
    return np.flatnonzero(np.any(over[cells], axis=1))


def _volumes(edges: Array) -> Array:
    """The determinants of (k, d, d): much faster than NumPy's for so small ones."""
    if edges.shape[1] == 2:
        return edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    return np.einsum("ki,ki->k", np.cross(edges[:, 0], edges[:, 1]), edges[:, 2])


def _angles(points: Array, cells: Integers) -> Array:
    """The angle of each triangle, the solid angle of each tetrahedron at its first vertex, (c,)."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    edges /= np.linalg.norm(edges, axis=2, keepdims=True)
    volume = np.abs(_volumes(edges))
    first, second = edges[:, 0], edges[:, 1]
    if edges.shape[1] == 2:
        return np.arctan2(volume, np.sum(first * second, axis=1))
    third = edges[:, 2]
    cosines = (np.sum(a * b, axis=1) for a, b in ((first, second), (second, third), (third, first)))
    return 2.0 * np.arctan2(volume, 1.0 + sum(cosines))


_EDGES = {2: [(0, 1)], 3: [(1, 2), (0, 2), (0, 1)]}
"""The edges of a facet by its corners, in the order of their midpoints, by the number of its corners."""
_CORNERS = {3: 2, 6: 3}
_FARTHEST = 0.25
"""The same along the edge: from there on the curve turns back."""
TURNING_BACK = "midpoint that lies beyond the middle half of its edge, where a curve of second order turns back; remesh"


def is_curved(facets: Array) -> bool:
    """Whether any midpoint is off the middle of its edge.

    Args:
        facets: by their nodes, corners first, then midpoints in the order of basix, (k, n, d).
    """
    off, edge = _offsets(facets)
    return bool(np.any(np.linalg.norm(off, axis=-1) > ROUNDING * np.linalg.norm(edge, axis=-1)))


def turning_back(facets: Array) -> Integers:
    """The numbers of the facets that have a midpoint too far from the middle of its edge.

    Args:
        facets: as for :func:`is_curved`.
    """
    off, edge = _offsets(facets)
    along = np.abs(np.sum(off * edge, axis=-1)) >= _FARTHEST * np.sum(edge**2, axis=-1)
    return np.flatnonzero(np.any(along, axis=1))


def _offsets(facets: Array) -> tuple[Array, Array]:
    """Midpoints from the middles of their edges, and the edges as vectors, (k, edges, d)."""
    corners = _CORNERS[facets.shape[1]]
    first, last = (facets[:, [pair[i] for pair in _EDGES[corners]]] for i in (0, 1))
    return facets[:, corners:] - (first + last) / 2, last - first
