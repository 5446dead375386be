"""Where the triangles of two sides in space lie over each other: polygons.

As in the plane (:mod:`.facet_overlaps`), a point of the second side belongs to the point of the first that it is
projected onto along the first facet's normal. Each facet of the first side has coordinates of its own, in which it is
the triangle (0, 0), (1, 0), (0, 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..geometry import tangents
from ..typing import Array, Integers, Mask
from .facet_overlaps import Facets, Overlaps
from .scaling import DEFAULT

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


_ANGLES = np.array([np.pi / 2, np.pi / 4, np.pi / 4])


def in_space(first: Facets, second: Facets) -> Overlaps:
    """The intersections of the facets of two sides in space.

    Args:
        first: the side onto which is projected.
        second: the other one.
    """
    number, other = candidates(first, second)
    frames = frames_of(first)[number]
    local = in_frames(second.corners[other], first.corners[number, 0], frames)
    clipped = clip(local[:, :, :2], number, np.abs(local[:, :, 2].mean(axis=1)), len(first.nodes))
    pair = clipped.outline
    return Overlaps(
        first=number[pair],
        second=other[pair],
        areas=np.abs(twice_areas(clipped.corners)) * first.areas[number[pair]],
        on_first=barycentric(np.broadcast_to(CORNERS, clipped.corners.shape), clipped.corners),
        on_second=barycentric(local[pair, :, :2], clipped.corners),
        covered=clipped.covered,
    )


@dataclass(frozen=True, kw_only=True)
class Clipped:
    """What convex outlines have in common with the first side's facets, cut into triangles (k of them).

    Attributes:
        corners: in the coordinates of the first side's facet, (k, 3, 2).
        outline: the outline of each, (k,).
        covered: whether they fill the angle at each corner of the first side's facets, (f, 3).
    """

    corners: Array
    outline: Integers
    covered: Mask


def clip(
    outlines: Array, number: Integers, distance: Array, count: int, uncovered: float = DEFAULT.uncovered
) -> Clipped:
    """Outlines clipped by the first side's facets, without what lies behind nearer ones.

    Args:
        outlines: triangles in the coordinates of the first side's facets, (p, 3, 2).
        number: the facet of each, (p,).
        distance: from it, (p,).
        count: of the first side's facets, f.
        uncovered: part of a facet at its end that may lie beyond the other side.
    """
    over = np.flatnonzero(np.all((outlines.min(axis=1) < 1.0) & (outlines.max(axis=1) > 0.0), axis=1))
    pieces = clip_triangles(outlines[over])
    solid = pieces.areas > DEFAULT.rounding
    pieces, outline = pieces.chosen(solid), over[solid]
    near = _nearest(pieces, number[outline], distance[outline])
    pieces, outline = pieces.chosen(near), outline[near]
    corners, of_piece = pieces.fans(DEFAULT.rounding)
    covered = _covered(pieces, number[outline], count, uncovered)
    return Clipped(corners=corners, outline=outline[of_piece], covered=covered)


def candidates(first: Facets, second: Facets) -> tuple[Integers, Integers]:
    """Pairs of facets that may lie over each other: the first side's facets, the second's, (p,) each.

    Args:
        first: the side onto which is projected.
        second: the other one.
    """
    (centres, radii), (others, other_radii) = _balls(first), _balls(second)
    normals, group = np.unique(np.round(first.normals, 12), axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    pairs: list[Integers] = [np.empty((0, 2), dtype=np.int64)]
    for own in np.split(order, np.flatnonzero(np.diff(group.ravel()[order])) + 1):
        normal = normals[group.ravel()[own[0]]]
        facing = np.flatnonzero(second.normals @ normal < -DEFAULT.facing)
        plane = tangents(normal[None])[0].T
        # A tree for few points would cost more than it saves.
        tree = KDTree(others[facing] @ plane, leafsize=max(16, len(facing) // len(own)))
        found = tree.query_ball_point(centres[own] @ plane, radii[own] + other_radii.max(), return_sorted=True)
        counts = [len(one) for one in found]
        pairs.append(np.column_stack([np.repeat(own, counts), facing[np.concatenate(found).astype(np.int64)]]))
    number, other = np.vstack(pairs).T
    return number, other


def _balls(facets: Facets) -> tuple[Array, Array]:
    """Centres (f, 3) and radii (f,) of balls around facets."""
    centres, hull = facets.corners.mean(axis=1), facets.hull
    return centres, np.linalg.norm(hull - centres[:, None], axis=2).max(axis=1)


def frames_of(first: Facets) -> Array:
    """Distances from a facet's first corner times these are its own coordinates, (f, 3, 3).

    Args:
        first: the side whose facets they are.
    """
    sides = first.corners[:, 1:] - first.corners[:, :1]
    return np.asarray(np.linalg.inv(np.concatenate([sides, first.normals[:, None]], axis=1)))


def in_frames(points: Array, starts: Array, frames: Array) -> Array:
    """Points in the coordinates of facets, the third along the normal, (p, n, 3).

    Args:
        points: m, (p, n, 3).
        starts: the first corners of the facets, m, (p, 3).
        frames: of the facets (:func:`frames_of`), (p, 3, 3).
    """
    return np.asarray(np.einsum("pvi,pij->pvj", points - starts[:, None], frames))


def _nearest(pieces: Polygons, number: Integers, distance: Array) -> Mask:
    """Which pieces do not lie behind nearer ones, (k,)."""
    kept, areas = np.ones(len(number), dtype=bool), pieces.areas
    sums = np.bincount(number, weights=areas, minlength=1)
    for crowded in np.flatnonzero(sums > 0.5 * (1.0 + 1e-9)):
        here = np.flatnonzero(number == crowded)
        nearer: Array = np.empty((0, 3, 2))
        for one in here[np.argsort(distance[here], kind="stable")]:
            fan = pieces.chosen(np.array([one])).fans(DEFAULT.rounding)[0]
            kept[one] = common_area(fan, nearer) < 0.5 * areas[one]
            nearer = np.concatenate([nearer, fan]) if kept[one] else nearer
    return kept


def _covered(pieces: Polygons, number: Integers, count: int, uncovered: float) -> Mask:
    """Whether the pieces fill the angle at each corner of the first side's facets, (count, 3)."""
    filled = np.zeros((count, 3))
    for corner, place in enumerate(CORNERS):
        polygon, angles = pieces.angles_at(place, uncovered)
        np.add.at(filled[:, corner], number[polygon], angles)
    return np.asarray(filled >= (1.0 - uncovered) * _ANGLES)
