"""The edges of a body in space: where its surface turns sharply, or ends."""

from __future__ import annotations

import numpy as np

from ...typing import Array, Integers, Mask
from .vtk_view import area_vectors

FLAT, SHALLOW = 1.0, 5.0
"""Degrees: facets that turn by less are one flat face; faces that turn by more have an edge between them."""
SHARP = 55.0
"""Degrees: facets that turn by less may be of a round surface; seven of them make a cylinder on a coarse mesh."""


def creases(points: Array, facets: Integers) -> Integers:
    """The edges where two facets meet at a sharp angle, and those of one facet only, by their two points, (k, 2).

    Args:
        points: where the points are at rest, m, (n, 3): magnified displacements would turn facets.
        facets: (m, 3).
    """
    sides = np.sort(np.concatenate([facets[:, [0, 1]], facets[:, [1, 2]], facets[:, [2, 0]]]), axis=1)
    _, first, edge, count = np.unique(
        sides[:, 0] * len(points) + sides[:, 1], return_index=True, return_inverse=True, return_counts=True
    )
    owner = np.argsort(edge.ravel(), kind="stable") % len(facets)
    start = np.cumsum(count) - count
    shared, drawn = count == 2, count == 1
    pairs = np.column_stack([owner[start[shared]], owner[start[shared] + 1]])
    turns = _turns(points, facets, *pairs.T)
    drawn[shared] = (turns > SHARP) | _between_faces(facets, pairs, turns, sides[first[count == 1]])
    return np.asarray(sides[first[drawn]])


def _between_faces(facets: Integers, pairs: Integers, turns: Array, border: Integers) -> Mask:
    """Which pairs of facets turn where two flat faces meet; strips of a round surface are no faces.

    Args:
        facets: (m, 3).
        pairs: facets that share an edge, (k, 2).
        turns: their angles, degrees, (k,).
        border: the edges of one facet only, (j, 2).
    """
    from scipy.sparse import coo_array  # a tenth of a second, which pictures in the plane need not wait for
    from scipy.sparse.csgraph import connected_components

    flat = pairs[turns < FLAT]
    graph = coo_array((np.ones(len(flat)), (flat[:, 0], flat[:, 1])), shape=(len(facets), len(facets)))
    patch = connected_components(graph, directed=False)[1]
    beside = patch[pairs]
    bent = (turns >= FLAT) & (turns <= SHARP) & (beside[:, 0] != beside[:, 1])
    neighbours = np.unique(np.sort(beside[bent], axis=1), axis=0)
    face = np.bincount(neighbours.ravel(), minlength=len(facets)) <= 1
    face[_with_inside(facets, patch, border)] = True
    return np.asarray(bent & (turns > SHALLOW) & face[beside].all(axis=1))


def _with_inside(facets: Integers, patch: Integers, border: Integers) -> Integers:
    """The patches that have a vertex inside: they are more than one cell wide.

    Args:
        facets: (m, 3).
        patch: of each facet, (m,).
        border: the edges of one facet only, (j, 2).
    """
    low, high = np.full(facets.max() + 1, len(facets)), np.full(facets.max() + 1, -1)
    np.minimum.at(low, facets, patch[:, None])
    np.maximum.at(high, facets, patch[:, None])
    inside = low == high
    inside[border] = False
    return np.asarray(low[inside])


def _turns(points: Array, facets: Integers, one: Integers, other: Integers) -> Array:
    """The angles between the normals of pairs of facets, degrees."""
    normals = area_vectors(points, facets)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    cosine = np.einsum("ki,ki->k", normals[one], normals[other])
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
