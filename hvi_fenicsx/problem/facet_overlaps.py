"""Where the facets of two sides that face each other lie over each other: intervals in the plane.

A point of the second side belongs to the point of the first that it is projected onto along the first facet's normal.
All products of linear functions of both sides are integrated exactly over the intersections of facets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers, Mask
from .thresholds import DEFAULT, Thresholds

_GAUSS = np.array([0.5 - np.sqrt(3.0) / 6.0, 0.5 + np.sqrt(3.0) / 6.0])
"""Points of the Gauss rule on [0, 1] that is exact up to degree 3; the weights are one half each."""


@dataclass(frozen=True, kw_only=True)
class Facets:
    """The facets of one side, the same on all ranks (f of them).

    Attributes:
        vertices: global numbers of their vertices, (f, d).
        corners: these vertices, m, (f, d, d).
        normals: outward unit normals, (f, d).
    """

    vertices: Integers
    corners: Array
    normals: Array


@dataclass(frozen=True, kw_only=True)
class Overlaps:
    """Integration points on the intersections of facets (p of them).

    Attributes:
        first: number of the first side's facet, (p,).
        second: number of the second side's facet, (p,).
        weights: of the points, m^(d-1), (p,).
        on_first: barycentric coordinates in the first facet, (p, d).
        on_second: in the second facet, (p, d).
        covered: whether each vertex of the first side's facets lies over the second side, (f, d).
    """

    first: Integers
    second: Integers
    weights: Array
    on_first: Array
    on_second: Array
    covered: Mask


def in_plane(first: Facets, second: Facets, thresholds: Thresholds = DEFAULT) -> Overlaps:
    """The intersections of the facets of two sides in the plane.

    Args:
        first: the side onto which is projected.
        second: the other one.
        thresholds: which facets face each other, and what is rounding.
    """
    pieces = [np.empty((0, 6))]
    covered = np.zeros((len(first.vertices), 2), dtype=bool)
    for number in range(len(first.vertices)):
        found = _nearest(_intervals(first, second, number, thresholds))
        pieces.append(np.column_stack([np.full(len(found), number), found]))
        begin, end = found[:, 1].min(initial=np.inf), found[:, 2].max(initial=-np.inf)
        covered[number] = begin <= thresholds.uncovered, end >= 1.0 - thresholds.uncovered
    whole = np.vstack(pieces)
    return _points(first, whole, covered)


def _intervals(first: Facets, second: Facets, number: int, thresholds: Thresholds) -> Array:
    """Facets over one of the first side: number, begin, end on it, and where these ends are on the facet, (k, 5)."""
    start, end = first.corners[number]
    length, normal = np.linalg.norm(end - start), first.normals[number]
    facing = np.flatnonzero(second.normals @ normal < -thresholds.facing)
    along = (second.corners[facing] - start) @ (end - start) / length**2
    low, high = np.maximum(along.min(axis=1), 0.0), np.minimum(along.max(axis=1), 1.0)
    over = high - low > thresholds.sliver
    facing, along, low, high = facing[over], along[over], low[over], high[over]
    width = along[:, 1] - along[:, 0]
    at = (np.stack([low, high], axis=1) - along[:, :1]) / width[:, None]
    distance = np.abs((second.corners[facing].mean(axis=1) - start) @ normal)
    order = np.argsort(distance, kind="stable")
    return np.column_stack([facing, low, high, at])[order]


def _nearest(intervals: Array) -> Array:
    """The intervals without those that lie behind nearer ones."""
    kept: list[Array] = []
    for one in intervals:
        hidden = sum(max(0.0, min(one[2], k[2]) - max(one[1], k[1])) for k in kept)
        if hidden < 0.5 * (one[2] - one[1]):
            kept.append(one)
    return np.array(kept).reshape(-1, 5)


def _points(first: Facets, pieces: Array, covered: Mask) -> Overlaps:
    """The integration points of intervals (first facet, second facet, begin, end, both on the second facet)."""
    number, other = pieces[:, 0].astype(np.int64), pieces[:, 1].astype(np.int64)
    lengths = np.linalg.norm(first.corners[number, 1] - first.corners[number, 0], axis=1)
    x = pieces[:, 2, None] + (pieces[:, 3] - pieces[:, 2])[:, None] * _GAUSS
    y = pieces[:, 4, None] + (pieces[:, 5] - pieces[:, 4])[:, None] * _GAUSS
    weights = np.repeat(lengths * (pieces[:, 3] - pieces[:, 2]) / 2.0, 2)
    return Overlaps(
        first=np.repeat(number, 2),
        second=np.repeat(other, 2),
        weights=weights,
        on_first=np.column_stack([1.0 - x.ravel(), x.ravel()]),
        on_second=np.column_stack([1.0 - y.ravel(), y.ravel()]),
        covered=covered,
    )
