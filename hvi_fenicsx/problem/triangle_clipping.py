"""What triangles have in common with the triangle (0, 0), (1, 0), (0, 1): convex polygons.

They are clipped by one edge after the other, so that nothing can go wrong where edges nearly coincide, as all do where
meshes match. (Of two triangles that share an edge to rounding the general intersection of GEOS may be one of them.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers, Mask

CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
"""The triangle that clips."""
_ONE = 1e-12
"""Distance up to which two corners of a polygon are one."""


@dataclass(frozen=True, kw_only=True)
class Polygons:
    """Convex polygons (k of them).

    Attributes:
        corners: the first one again behind the last, (k, v, 2).
        sizes: numbers of corners, (k,).
    """

    corners: Array
    sizes: Integers

    @property
    def areas(self) -> Array:
        """Their areas, (k,)."""
        x, y = np.moveaxis(self.corners - self.corners[:, :1], 2, 0)
        return np.asarray(np.abs(np.sum(x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1), axis=1)) / 2)

    def chosen(self, which: Mask | Integers) -> Polygons:
        """Some of them.

        Args:
            which: a mask (k,), or numbers.
        """
        return Polygons(corners=self.corners[which], sizes=self.sizes[which])

    def fans(self, least: float) -> tuple[Array, Integers]:
        """Triangles about the first corners (n, 3, 2), and the polygon of each (n,).

        Args:
            least: the area over 1/2 from which a triangle counts.
        """
        polygon, corner = np.nonzero(np.arange(2, self.corners.shape[1]) < self.sizes[:, None])
        of = self.corners[polygon]
        rows = np.arange(len(polygon))
        triangles = np.stack([of[:, 0], of[rows, corner + 1], of[rows, corner + 2]], axis=1)
        large = np.abs(twice_areas(triangles)) > least
        return triangles[large], polygon[large]

    def angles_at(self, place: Array, near: float) -> tuple[Integers, Array]:
        """Polygons with a corner at a place (n,), and the angles there (n,).

        Args:
            place: (2,).
            near: distance of a corner that is there.
        """
        there = np.linalg.norm(self.corners - place, axis=2) <= near
        polygon, corner = np.nonzero(there & (np.arange(self.corners.shape[1]) < self.sizes[:, None]))
        size = self.sizes[polygon]
        at, before, after = (self.corners[polygon, number % size] for number in (corner, corner - 1, corner + 1))
        one, other = before - at, after - at
        cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
        return polygon, np.abs(np.arctan2(cross, np.sum(one * other, axis=1)))


def clip_triangles(triangles: Array) -> Polygons:
    """What triangles have in common with that of :data:`CORNERS`.

    Args:
        triangles: (p, 3, 2).
    """
    ring = np.concatenate([1.0 - triangles.sum(axis=2, keepdims=True), triangles], axis=2)
    sizes: Integers = np.full(len(ring), 3, dtype=np.int64)
    for side in range(3):
        ring, sizes = _cut(ring, sizes, side)
    inside = np.arange(ring.shape[1]) < sizes[:, None]
    apart = np.abs(ring - _following(ring, sizes)).max(axis=2, initial=0.0) > _ONE
    ring, sizes = _compact(ring, inside & apart)
    inside = np.arange(ring.shape[1]) < sizes[:, None]
    return Polygons(corners=np.where(inside[:, :, None], ring, ring[:, :1])[:, :, 1:], sizes=sizes)


def _cut(ring: Array, sizes: Integers, side: int) -> tuple[Array, Integers]:
    """Convex polygons by the barycentric coordinates of their corners (p, v, 3), where one coordinate is positive."""
    following, inside = _following(ring, sizes), np.arange(ring.shape[1]) < sizes[:, None]
    here, there = ring[:, :, side], following[:, :, side]
    across = inside & ((here >= 0.0) != (there >= 0.0))
    share = np.divide(here, here - there, out=np.zeros_like(here), where=across)
    cut = ring + share[:, :, None] * (following - ring)
    cut[:, :, side] = 0.0
    both = np.stack([ring, cut], axis=2).reshape(len(ring), 2 * ring.shape[1], 3)
    return _compact(both, np.stack([inside & (here >= 0.0), across], axis=2).reshape(both.shape[:2]))


def _following(ring: Array, sizes: Integers) -> Array:
    """The corner after each one, (p, v, 3)."""
    number = (np.arange(ring.shape[1]) + 1) % np.maximum(sizes, 1)[:, None]
    return np.take_along_axis(ring, number[:, :, None], axis=1)


def _compact(ring: Array, kept: Mask) -> tuple[Array, Integers]:
    """The corners that are kept, in their order, and how many."""
    sizes = kept.sum(axis=1)
    order = np.argsort(~kept, axis=1, kind="stable")[:, : max(int(sizes.max(initial=0)), 1)]
    return np.take_along_axis(ring, order[:, :, None], axis=1), sizes


def common_area(triangles: Array, others: Array) -> float:
    """The area that triangles have in common with others; neither overlap among themselves.

    Args:
        triangles: (n, 3, 2).
        others: (m, 3, 2).
    """
    sides = others[:, 1:] - others[:, :1]
    local = (triangles[None] - others[:, None, :1]) @ np.linalg.inv(sides)[:, None]
    common = clip_triangles(local.reshape(-1, 3, 2)).areas.reshape(len(others), len(triangles))
    return float(np.sum(common.sum(axis=1) * np.abs(np.linalg.det(sides))))


def twice_areas(triangles: Array) -> Array:
    """Determinants of triangles, in parts of an area of 1/2, (n,).

    Args:
        triangles: (n, 3, 2).
    """
    return np.asarray(np.linalg.det(triangles[:, 1:] - triangles[:, :1]))


def barycentric(triangles: Array, points: Array) -> Array:
    """Barycentric coordinates of points in triangles, (n, q, 3).

    Args:
        triangles: (n, 3, 2).
        points: (n, q, 2).
    """
    sides = triangles[:, 1:] - triangles[:, :1]
    found = (points - triangles[:, :1]) @ np.linalg.inv(sides)
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
