"""Facets of second order: which are curved, and which turn back. Light, since gmsh's own process uses it."""

from __future__ import annotations

import numpy as np

from ..typing import Array, Integers

_EDGES = {2: [(0, 1)], 3: [(1, 2), (0, 2), (0, 1)]}
"""The edges of a facet by its corners, in the order of their midpoints, by the number of its corners."""
_CORNERS = {3: 2, 6: 3}
_STRAIGHT = 1e-9
"""Distance of a midpoint from the middle of its edge over the edge's length that is rounding."""
_FARTHEST = 0.25
"""The same along the edge: from there on the curve turns back."""
TURNING_BACK = "midpoint that lies beyond the middle half of its edge, where a curve of second order turns back; remesh"


def is_curved(facets: Array) -> bool:
    """Whether any midpoint is off the middle of its edge.

    Args:
        facets: by their nodes, corners first, then midpoints in the order of basix, (k, n, d).
    """
    off, edge = _offsets(facets)
    return bool(np.any(np.linalg.norm(off, axis=-1) > _STRAIGHT * np.linalg.norm(edge, axis=-1)))


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
