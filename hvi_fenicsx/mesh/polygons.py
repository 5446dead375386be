"""Plane polygons: their area, whether one holds a point, and whether edges touch each other."""

from __future__ import annotations

import numpy as np

from ..typing import Array, Integers, Mask


def area(polygon: Array) -> float:
    """Area (m²) within the corners (n, 2), positive where they run counterclockwise."""
    x, y = polygon.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def holds(polygon: Array, point: Array) -> bool:
    """Whether a point lies within a polygon: an odd number of edges lies to its right.

    Args:
        polygon: the corners, (n, 2).
        point: on no edge, (2,).
    """
    a, b = polygon, np.roll(polygon, -1, axis=0)
    crossing = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[crossing], b[crossing]
    x = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(x > point[0]) % 2)


def edges_touch(ends: Integers, segments: Array, parallel: float) -> bool:
    """Whether two edges meet elsewhere than in a vertex of both, or leave a vertex in the same direction.

    Args:
        ends: the two vertices of each edge, (n, 2).
        segments: their coordinates, (n, 2, 2).
        parallel: angle (radian) up to which two directions are the same.
    """
    for i in range(len(ends) - 1):
        shared = np.isin(ends[i + 1 :], ends[i]).any(axis=1)
        if np.any(_meeting(segments[i], segments[i + 1 :]) & ~shared):
            return True
    away = np.concatenate([segments[:, 1] - segments[:, 0], segments[:, 0] - segments[:, 1]])
    angle, start = np.arctan2(away[:, 1] + 0.0, away[:, 0]), ends.T.ravel()  # no -0, whose angle would be -π
    order = np.lexsort((angle, start))
    return bool(np.any((np.diff(start[order]) == 0) & (np.diff(angle[order]) < parallel)))


def _meeting(one: Array, others: Array) -> Mask:
    """Which of the segments (n, 2, 2) meet one segment (2, 2), ends included."""
    (a, b), (c, d) = one, others.transpose(1, 0, 2)
    near = (np.maximum(a, b) >= np.minimum(c, d)) & (np.minimum(a, b) <= np.maximum(c, d))
    apart = (_left(a, b, c) * _left(a, b, d) > 0) | (_left(c, d, a) * _left(c, d, b) > 0)
    return np.asarray(near.all(axis=1) & ~apart)


def _left(a: Array, b: Array, point: Array) -> Array:
    """Twice the area of the triangle a, b, point, which is positive where the point is to the left."""
    (ux, uy), (vx, vy) = np.moveaxis(b - a, -1, 0), np.moveaxis(point - a, -1, 0)
    return np.asarray(ux * vy - uy * vx)
