"""The shapes of curved facets: parabolas, and triangles with six nodes, at points by barycentric coordinates."""

from __future__ import annotations

import basix
import numpy as np

from ..typing import Array
from . import spaces
from .facet_overlaps import Facets, OverlapPoints


def places(nodes: Array, barycentric: Array) -> Array:
    """Where points are, (p, k).

    Args:
        nodes: of the facet of each point, corners first, then midpoints of edges in the order of basix, (p, n, k).
        barycentric: the points, (p, d).
    """
    return np.asarray(np.einsum("pn,pnk->pk", spaces.simplex_functions(2, barycentric), nodes))


def slopes(nodes: Array, barycentric: Array) -> Array:
    """The derivatives of the place by all barycentric coordinates but the first, (p, d-1, k).

    Args:
        nodes: as for :func:`places`.
        barycentric: the points, (p, d).
    """
    d = barycentric.shape[1]
    by = (4.0 * barycentric - 1.0)[:, :, None] * nodes[:, :d]
    edges: list[list[int]] = basix.topology(basix.CellType.interval if d == 2 else basix.CellType.triangle)[1]
    for node, (a, b) in enumerate(edges, d):
        by[:, a] += 4.0 * barycentric[:, [b]] * nodes[:, node]
        by[:, b] += 4.0 * barycentric[:, [a]] * nodes[:, node]
    return np.asarray(by[:, 1:] - by[:, :1])


def across(slopes: Array) -> Array:
    """Vectors along the normals, their lengths what a facet has of length or area there, (p, d).

    Args:
        slopes: in d dimensions, (p, d-1, d).
    """
    if slopes.shape[2] == 2:
        return np.column_stack([slopes[:, 0, 1], -slopes[:, 0, 0]])
    return np.asarray(np.cross(slopes[:, 0], slopes[:, 1]), dtype=np.float64)


def normals(first: Facets, points: OverlapPoints) -> Array:
    """The outward unit normals of the first side at points, (p, d).

    Args:
        first: the side.
        points: on its intersections with the other one.
    """
    found = across(slopes(first.points[points.first], points.on_first))
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    return np.asarray(found * np.sign(np.sum(found * first.normals[points.first], axis=1, keepdims=True)))
