"""Where the triangles of two sides in space lie over each other: polygons, clipped by GEOS (shapely).

As in the plane (:mod:`.facet_overlaps`), a point of the second side belongs to the point of the first that it is
projected onto along the first facet's normal. Each facet of the first side has coordinates of its own, in which it is
the triangle (0, 0), (1, 0), (0, 1).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import KDTree

from ..typing import Array, Integers, Mask
from .contact_surface import tangents
from .facet_overlaps import Facets, Overlaps
from .thresholds import DEFAULT, Thresholds

_Shapes = npt.NDArray[np.object_]
CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
_ANGLES = np.array([np.pi / 2, np.pi / 4, np.pi / 4])


def in_space(first: Facets, second: Facets, thresholds: Thresholds = DEFAULT) -> Overlaps:
    """The intersections of the facets of two sides in space.

    Args:
        first: the side onto which is projected.
        second: the other one.
        thresholds: which facets face each other, and what is rounding.
    """
    number, other = candidates(first, second, thresholds)
    frames = frames_of(first)[number]
    local = in_frames(second.corners[other], first.corners[number, 0], frames)
    clipped = clip(local[:, :, :2], number, np.abs(local[:, :, 2].mean(axis=1)), len(first.nodes), thresholds)
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


def clip(outlines: Array, number: Integers, distance: Array, count: int, thresholds: Thresholds) -> Clipped:
    """Outlines clipped by the first side's facets, without what lies behind nearer ones.

    Args:
        outlines: triangles in the coordinates of the first side's facets, (p, 3, 2).
        number: the facet of each, (p,).
        distance: from it, (p,).
        count: of the first side's facets, f.
        thresholds: what is rounding.
    """
    over = np.flatnonzero(np.all((outlines.min(axis=1) < 1.0) & (outlines.max(axis=1) > 0.0), axis=1))
    clipped = shapely.intersection(_polygons(CORNERS[None])[0], _polygons(outlines[over]))
    pieces, of_outline = shapely.get_parts(clipped, return_index=True)
    solid = (shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON) & (shapely.area(pieces) > thresholds.sliver)
    pieces, of_outline = pieces[solid], over[of_outline[solid]]
    near = _nearest(pieces, number[of_outline], distance[of_outline])
    pieces, of_outline = pieces[near], of_outline[near]
    corners, of_piece = _fans(pieces)
    large = np.abs(twice_areas(corners)) > thresholds.sliver
    covered = _covered(pieces, number[of_outline], count, thresholds)
    return Clipped(corners=corners[large], outline=of_outline[of_piece[large]], covered=covered)


def candidates(first: Facets, second: Facets, thresholds: Thresholds) -> tuple[Integers, Integers]:
    """Pairs of facets that may lie over each other: the first side's facets, the second's, (p,) each.

    Args:
        first: the side onto which is projected.
        second: the other one.
        thresholds: which facets face each other.
    """
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
    centres, hull = facets.corners.mean(axis=1), facets.hull
    return centres, np.linalg.norm(hull - centres[:, None], axis=2).max(axis=1)


def frames_of(first: Facets) -> Array:
    """Of the first side's facets: distances from the first corner times these are its own coordinates, (f, 3, 3)."""
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
    for corner, place_of in enumerate(CORNERS):
        near = np.linalg.norm(corners[at] - place_of, axis=1) <= thresholds.uncovered
        np.add.at(filled[:, corner], number[polygon[at[near]]], angles[near])
    return np.asarray(filled >= (1.0 - thresholds.uncovered) * _ANGLES)


def _angles(one: Array, other: Array) -> Array:
    """The angles between vectors (n, 2)."""
    cross = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, np.sum(one * other, axis=1))))


def _fans(pieces: _Shapes) -> tuple[Array, Integers]:
    """Convex polygons as fans of triangles about their first corners (k, 3, 2), and the polygon of each (k,)."""
    corners, polygon, place = _rings(pieces)
    sizes = np.bincount(polygon, minlength=len(pieces))
    at = np.flatnonzero((place > 0) & (place < sizes[polygon] - 2))
    return np.stack([corners[at - place[at]], corners[at], corners[at + 1]], axis=1), polygon[at]


def twice_areas(triangles: Array) -> Array:
    """Determinants of triangles (n, 3, 2), in parts of a facet's area 1/2, (n,)."""
    return np.asarray(np.linalg.det(triangles[:, 1:] - triangles[:, :1]))


def barycentric(triangles: Array, points: Array) -> Array:
    """Barycentric coordinates of points (n, q, 2) in triangles (n, 3, 2), (n, q, 3)."""
    sides = triangles[:, 1:] - triangles[:, :1]
    found = (points - triangles[:, :1]) @ np.linalg.inv(sides)
    return np.concatenate([1.0 - found.sum(axis=2, keepdims=True), found], axis=2)
