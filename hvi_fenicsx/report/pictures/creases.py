"""The edges of a body in space: where its surface turns sharply, or ends."""

from __future__ import annotations

import numpy as np

from ...typing import Array, Integers
from .vtk_view import area_vectors

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
    shared = count == 2
    drawn = count == 1
    drawn[shared] = _turns(points, facets, owner[start[shared]], owner[start[shared] + 1]) > SHARP
    return np.asarray(sides[first[drawn]])


def _turns(points: Array, facets: Integers, one: Integers, other: Integers) -> Array:
    """The angles between the normals of pairs of facets, degrees."""
    normals = area_vectors(points, facets)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    cosine = np.einsum("ki,ki->k", normals[one], normals[other])
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
