"""Where the curved facets of two sides in the plane lie over each other.

A point of the second side belongs to the point of the first that it is projected onto along the normal of the first
facet's chord, as of straight facets (:mod:`.facet_overlaps`). Places along this chord are quadratic in the reference
coordinates of both facets, so pairs of points are found in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import basix
import numpy as np
from typing_extensions import override

from ..typing import Array, Integers, Mask
from . import facet_overlaps, facet_polygons, spaces
from .facet_overlaps import Facets, OverlapPoints, Overlaps
from .scaling import DEFAULT


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


_DEGREE = 12
"""Degree of the quadrature: lengths are square roots of polynomials, nearly constant ones."""


@dataclass(frozen=True, kw_only=True)
class CurvedOverlaps(Overlaps):
    """The intersections of curved facets (k of them).

    Attributes:
        nodes: of the first side's facet, both ends and the middle, m, (k, 3, 2).
        own: the places of these along their chord, from 0 to 1, (k, 3).
        other: those of the nodes of the second side's facet, (k, 3).
    """

    nodes: Array
    own: Array
    other: Array

    @override
    def points(self, degree: int) -> OverlapPoints:
        made: tuple[Any, Any] = basix.make_quadrature(basix.CellType.interval, _DEGREE)
        places = made[0][:, 0]
        return self.sampled(np.column_stack([1.0 - places, places]), made[1], np.arange(len(self.first)))

    @override
    def sampled(self, rule: Array, shares: Array, chosen: Integers) -> OverlapPoints:
        straight = super().sampled(rule, shares, chosen)
        each = np.repeat(chosen, len(rule))
        s, ends = straight.on_first[:, 1], self.on_first[each, :, 1]
        t = _where(self.other[each], _place(self.own[each], s))
        part = np.tile(shares, len(chosen)) * (ends[:, 1] - ends[:, 0])
        speed = np.linalg.norm(slopes(self.nodes[each], straight.on_first)[:, 0], axis=1)
        return replace(straight, weights=part * speed, on_second=np.column_stack([1.0 - t, t]))


def in_plane(first: Facets, second: Facets) -> CurvedOverlaps:
    """The intersections of the facets of two sides.

    Args:
        first: the side onto which is projected.
        second: the other one.
    """
    chords = facet_overlaps.in_plane(first, second)
    nodes, own = first.points[chords.first], _along(first, chords.first, first.points[chords.first])
    other = _along(first, chords.first, second.points[chords.second])
    places = chords.on_first[:, :, 1]
    s, t = (np.stack([_where(of, places[:, end]) for end in (0, 1)], axis=1) for of in (own, other))
    return CurvedOverlaps(
        first=chords.first,
        second=chords.second,
        areas=chords.areas,
        on_first=np.stack([1.0 - s, s], axis=2),
        on_second=np.stack([1.0 - t, t], axis=2),
        covered=chords.covered,
        nodes=nodes,
        own=own,
        other=other,
    )


def _along(first: Facets, facets: Integers, points: Array) -> Array:
    """The places of points (k, n, 2) along the chords of the first side's facets, (k, n)."""
    start, end = np.moveaxis(first.corners[facets], 1, 0)
    chord = end - start
    return np.asarray(np.einsum("knd,kd->kn", points - start[:, None], chord) / np.sum(chord**2, axis=1)[:, None])


def _place(of: Array, s: Array) -> Array:
    """The place along the chord (p,) at a reference coordinate, of both ends and the middle (p, 3)."""
    start, end, middle = of.T
    return np.asarray(start + (end - start) * s + 4.0 * s * (1.0 - s) * (middle - (start + end) / 2))


def _where(of: Array, place: Array) -> Array:
    """The reference coordinate (p,) at a place along the chord, of both ends and the middle (p, 3)."""
    start, end, middle = of.T
    bend = 4.0 * (middle - (start + end) / 2)
    speed = end - start + bend  # at the start
    root = np.sqrt(np.maximum(speed**2 - 4.0 * bend * (place - start), 0.0))
    return np.asarray(2.0 * (place - start) / (speed + np.copysign(root, speed)))


_EDGES = [[1, 2], [0, 2], [0, 1]]
"""The ends of the edge opposite to each corner."""
_STEPS = 12
"""Newton steps to a place in a curved facet; what they have not found by then is far outside."""
_FOUND = 1e-12
"""Distance over the facet's length that is rounding."""


@dataclass(frozen=True, kw_only=True)
class CurvedPolygons(Overlaps):
    """The intersections of curved facets in space (k of them).

    Attributes:
        own: the nodes of the first side's facet in its own coordinates, (k, 6, 2).
        others: those of the second side's facet in these, (k, 6, 2).
        nodes: of the first side's facet, m, (k, 6, 3).
        degree: of the quadrature: functions at pairs of points are nearly polynomials.
    """

    own: Array
    others: Array
    nodes: Array
    degree: int

    @override
    def points(self, degree: int) -> OverlapPoints:
        made: tuple[Any, Any] = basix.make_quadrature(basix.CellType.triangle, self.degree)
        rule = np.column_stack([1.0 - made[0].sum(axis=1), made[0]])
        return self.sampled(rule, made[1] / made[1].sum(), np.arange(len(self.first)))

    @override
    def sampled(self, rule: Array, shares: Array, chosen: Integers) -> OverlapPoints:
        flat = super().sampled(rule, shares, chosen)
        each = np.repeat(chosen, len(rule))
        at = places(self.own[each], flat.on_first)
        part = np.outer(facet_polygons.twice_areas(self.on_first[chosen][:, :, 1:]), shares / 2).ravel()
        size = np.linalg.norm(across(slopes(self.nodes[each], flat.on_first)), axis=1)
        return replace(
            flat, weights=np.abs(part) * size, on_second=_local_coordinates(self.others[each], at, flat.on_second)
        )


def in_space(first: Facets, second: Facets) -> CurvedPolygons:
    """The intersections of the curved facets of two sides in space.

    Args:
        first: the side onto which is projected.
        second: the other one.
    """
    pairs = _pairs(first, second)
    pair, of_second = _parts(second, pairs.other, DEFAULT.rim_parts)
    outlines = _outlines(first, second, pairs, pair, of_second, DEFAULT.rim)
    clipped = facet_polygons.clip(outlines, pairs.number[pair], pairs.distance[pair], len(first.nodes), DEFAULT.rim)
    own, part = pair[clipped.outline], facet_polygons.barycentric(outlines[clipped.outline], clipped.corners)
    number, x, y = pairs.number[own], *np.moveaxis(clipped.corners, 2, 0)
    return CurvedPolygons(
        first=number,
        second=pairs.other[own],
        areas=np.abs(facet_polygons.twice_areas(clipped.corners)) * first.areas[number],
        on_first=np.stack([1.0 - x - y, x, y], axis=2),
        on_second=part @ of_second[clipped.outline],
        covered=clipped.covered,
        own=pairs.own[number],
        others=pairs.local[own],
        nodes=first.points[number],
        degree=DEFAULT.curved_degree,
    )


@dataclass(frozen=True, kw_only=True)
class _Pairs:
    """Pairs of facets that may lie over each other (p of them).

    Attributes:
        number: the first side's facet, (p,).
        other: the second side's, (p,).
        local: the nodes of this in the first facet's coordinates, (p, 6, 2).
        distance: from it, (p,).
        own: the nodes of all facets of the first side in their own coordinates, (f, 6, 2).
    """

    number: Integers
    other: Integers
    local: Array
    distance: Array
    own: Array


def _pairs(first: Facets, second: Facets) -> _Pairs:
    number, other = facet_polygons.candidates(first, second)
    frames, starts = facet_polygons.frames_of(first), first.corners[:, 0]
    local = facet_polygons.in_frames(second.points[other], starts[number], frames[number])
    return _Pairs(
        number=number,
        other=other,
        local=local[:, :, :2],
        distance=np.abs(local[:, :3, 2].mean(axis=1)),
        own=facet_polygons.in_frames(first.points, starts, frames)[:, :, :2],
    )


def _parts(second: Facets, other: Integers, count: int) -> tuple[Integers, Array]:
    """Triangles (o) whose edges stand for the curved ones: the pair of each (o,), its corners on the facet (o, 3, 3).

    Two neighbours share a chord. Where a side ends it has to end where the other does: the edge is cut into parts.
    """
    rim = _rim_edges(second)[other]
    inside = np.flatnonzero(~rim.any(axis=1))
    pairs, corners = [inside], [np.broadcast_to(np.eye(3), (len(inside), 3, 3))]
    for pattern in np.unique(rim[rim.any(axis=1)], axis=0):
        here, parts = np.flatnonzero(np.all(rim == pattern, axis=1)), _fan(pattern, count)
        pairs.append(np.repeat(here, len(parts)))
        corners.append(np.tile(parts, (len(here), 1, 1)))
    return np.concatenate(pairs), np.concatenate(corners)


def _fan(pattern: Mask, count: int) -> Array:
    """A facet as triangles about its middle, with so many on edges that are on the rim (3,); corners (s, 3, 3)."""
    around: list[Array] = []
    for edge in range(3):
        a, b = np.eye(3)[(edge + 1) % 3], np.eye(3)[(edge + 2) % 3]
        many = count if pattern[edge] else 1
        around += [a * (many - step) / many + b * step / many for step in range(many)]
    return np.stack(
        [np.stack([np.full(3, 1 / 3), p, q]) for p, q in zip(around, [*around[1:], around[0]], strict=True)]
    )


def _outlines(first: Facets, second: Facets, pairs: _Pairs, pair: Integers, of_second: Array, rim: float) -> Array:
    """Triangles of the second side's facets (o, 3, 3) in the reference coordinates of the first's, (o, 3, 2)."""
    each = np.repeat(pair, 3)
    at = places(pairs.local[each], of_second.reshape(-1, 3))
    straight = np.column_stack([1.0 - at.sum(axis=1), at])
    found = _local_coordinates(pairs.own[pairs.number[each]], at, straight).reshape(-1, 3, 3)
    both = _on_rim(second, pairs.other[pair], of_second)[:, :, None] & _rim_edges(first)[pairs.number[pair]][:, None]
    found[both & (np.abs(found) < rim)] = 0.0
    return np.asarray(found[:, :, 1:] / found.sum(axis=2, keepdims=True))


def _rim_edges(side: Facets) -> Mask:
    """Whether no other facet of the side has the edge opposite to each corner, (f, 3)."""
    edges = np.sort(side.nodes[:, _EDGES], axis=2)
    _, which, times = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True)
    return np.asarray(times[which.ravel()].reshape(-1, 3) == 1)


def _on_rim(side: Facets, facets: Integers, places: Array) -> Mask:
    """Whether places (o, 3, 3) of facets (o,) are on the rim of the side, (o, 3)."""
    alone = _rim_edges(side)
    corners = np.isin(side.nodes[:, :3], side.nodes[:, _EDGES][alone])
    on_edge, at_corner = places == 0.0, places == 1.0
    return np.asarray(np.any(alone[facets][:, None] & on_edge | corners[facets][:, None] & at_corner, axis=2))


def _local_coordinates(nodes: Array, at: Array, start: Array) -> Array:
    """The barycentric coordinates of places (p, 2) in curved facets (p, 6, 2), or the start where there are none."""
    found, open_ = start.copy(), np.arange(len(start))
    for _ in range(_STEPS):
        left = at[open_] - places(nodes[open_], found[open_])
        step = _solved(slopes(nodes[open_], found[open_]), left)
        found[open_] += np.column_stack([-step.sum(axis=1), step])
        open_ = open_[np.abs(left).max(axis=1) > _FOUND]
    turned = np.linalg.det(slopes(nodes, found)) * np.linalg.det(nodes[:, 1:3] - nodes[:, :1]) <= 0.0
    lost = np.union1d(open_, np.flatnonzero(turned))
    found[lost] = start[lost]
    return found


def _solved(slopes: Array, left: Array) -> Array:
    """The steps s with s @ slopes = left, (p, 2); none where that is singular."""
    (a, b), (c, d) = np.moveaxis(slopes, 0, 2)
    x, y = left.T
    size = a * d - b * c
    size = np.where(size == 0.0, np.inf, size)
    return np.column_stack([(d * x - c * y) / size, (a * y - b * x) / size])
