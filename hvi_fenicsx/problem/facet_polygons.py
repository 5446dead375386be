"""Where the triangles of two sides in space lie over each other: polygons, clipped by GEOS (shapely).

As in the plane (:mod:`.facet_overlaps`), a point of the second side belongs to the point of the first that it is
projected onto along the first facet's normal. Each facet of the first side has coordinates of its own, in which it is
the triangle (0, 0), (1, 0), (0, 1).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import KDTree

from ..typing import Array, Integers, Mask
from .contact_surface import tangents
from .facet_overlaps import Facets, Overlaps
from .thresholds import DEFAULT, Thresholds

_Shapes = npt.NDArray[np.object_]
_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
_ANGLES = np.array([np.pi / 2, np.pi / 4, np.pi / 4])


def in_space(first: Facets, second: Facets, thresholds: Thresholds = DEFAULT) -> Overlaps:
    """The intersections of the facets of two sides in space.

    Args:
        first: the side onto which is projected.
        second: the other one.
        thresholds: which facets face each other, and what is rounding.
    """
    number, other = _candidates(first, second, thresholds)
    triangles, distance = _projected(first, second, number, other)
    over = np.all((triangles.min(axis=1) < 1.0) & (triangles.max(axis=1) > 0.0), axis=1)
    number, other, triangles, distance = number[over], other[over], triangles[over], distance[over]
    clipped = shapely.intersection(_polygons(_CORNERS[None])[0], _polygons(triangles))
    pieces, of_pair = shapely.get_parts(clipped, return_index=True)
    solid = (shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON) & (shapely.area(pieces) > thresholds.sliver)
    pieces, of_pair = pieces[solid], of_pair[solid]
    near = _nearest(pieces, number[of_pair], distance[of_pair])
    pieces, of_pair = pieces[near], of_pair[near]
    covered = _covered(pieces, number[of_pair], len(first.nodes), thresholds)
    return _triangles(first, pieces, (number[of_pair], other[of_pair]), triangles[of_pair], covered)


def _candidates(first: Facets, second: Facets, thresholds: Thresholds) -> tuple[Integers, Integers]:
    """Pairs of facets that may lie over each other: the first side's facets, the second's, (p,) each."""
    (centres, radii), (others, other_radii) = _balls(first), _balls(second)
    normals, group = np.unique(np.round(first.normals, 12), axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    pairs: list[Integers] = [np.empty((0, 2), dtype=np.int64)]
    for own in np.split(order, np.flatnonzero(np.diff(group.ravel()[order])) + 1):
        normal = normals[group.ravel()[own[0]]]
        facing = np.flatnonzero(second.normals @ normal < -thresholds.facing)
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
    centres = facets.corners.mean(axis=1)
    return centres, np.linalg.norm(facets.corners - centres[:, None], axis=2).max(axis=1)


def _projected(first: Facets, second: Facets, number: Integers, other: Integers) -> tuple[Array, Array]:
    """The second side's facets in the coordinates of the first's (p, 3, 2), and how far they are from it (p,)."""
    start = first.corners[:, :1]
    frames = np.linalg.inv(np.concatenate([first.corners[:, 1:] - start, first.normals[:, None]], axis=1))
    local = np.einsum("pvi,pij->pvj", second.corners[other] - start[number], frames[number])
    return local[:, :, :2], np.abs(local[:, :, 2].mean(axis=1))


def _polygons(corners: Array) -> _Shapes:
    """Triangles (p, 3, 2)."""
    return np.asarray(shapely.polygons(corners), dtype=np.object_)


def _nearest(pieces: _Shapes, number: Integers, distance: Array) -> Mask:
    """Which pieces do not lie behind nearer ones, (k,)."""
    kept, areas = np.ones(len(pieces), dtype=bool), shapely.area(pieces)
    sums = np.bincount(number, weights=areas, minlength=1)
    for crowded in np.flatnonzero(sums > 0.5 * (1.0 + 1e-9)):
        here = np.flatnonzero(number == crowded)
        nearer: list[int] = []
        for one in here[np.argsort(distance[here], kind="stable")]:
            kept[one] = shapely.area(shapely.intersection(pieces[nearer], pieces[one])).sum() < 0.5 * areas[one]
            nearer += [one] if kept[one] else []
    return kept


def _rings(pieces: _Shapes) -> tuple[Array, Integers, Integers]:
    """The corners of polygons (n, 2), the first one again at the end; the polygon of each, and its place therein."""
    corners, polygon = shapely.get_coordinates(pieces, return_index=True)
    starts = np.searchsorted(polygon, np.arange(len(pieces)))
    return corners, polygon, np.arange(len(polygon)) - starts[polygon]


def _covered(pieces: _Shapes, number: Integers, count: int, thresholds: Thresholds) -> Mask:
    """Whether the pieces fill the angle at each corner of the first side's facets, (count, 3)."""
    corners, polygon, place = _rings(pieces)
    sizes = np.bincount(polygon, minlength=len(pieces))
    at = np.flatnonzero(place < sizes[polygon] - 1)
    before = np.where(place[at] > 0, at - 1, at + sizes[polygon[at]] - 2)
    angles = _angles(corners[before] - corners[at], corners[at + 1] - corners[at])
    filled = np.zeros((count, 3))
    for corner, place_of in enumerate(_CORNERS):
        near = np.linalg.norm(corners[at] - place_of, axis=1) <= thresholds.uncovered
        np.add.at(filled[:, corner], number[polygon[at[near]]], angles[near])
    return np.asarray(filled >= (1.0 - thresholds.uncovered) * _ANGLES)


def _angles(one: Array, other: Array) -> Array:
    """The angles between vectors (n, 2)."""
    cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, np.sum(one * other, axis=1))))


def _triangles(
    first: Facets, pieces: _Shapes, pairs: tuple[Integers, Integers], triangles: Array, covered: Mask
) -> Overlaps:
    """Convex polygons as intersections, each a fan of triangles about its first corner."""
    corners, polygon, place = _rings(pieces)
    sizes = np.bincount(polygon, minlength=len(pieces))
    at = np.flatnonzero((place > 0) & (place < sizes[polygon] - 2))
    fan, of_piece = np.stack([corners[at - place[at]], corners[at], corners[at + 1]], axis=1), polygon[at]
    areas = np.abs(np.linalg.det(fan[:, 1:] - fan[:, :1])) * first.areas[pairs[0][of_piece]]
    return Overlaps(
        first=pairs[0][of_piece],
        second=pairs[1][of_piece],
        areas=areas,
        on_first=_barycentric(np.broadcast_to(_CORNERS, fan.shape), fan),
        on_second=_barycentric(triangles[of_piece], fan),
        covered=covered,
    )


def _barycentric(triangles: Array, points: Array) -> Array:
    """Barycentric coordinates of points (n, q, 2) in triangles (n, 3, 2), (n, q, 3)."""
    sides = triangles[:, 1:] - triangles[:, :1]
    found = (points - triangles[:, :1]) @ np.linalg.inv(sides)
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
