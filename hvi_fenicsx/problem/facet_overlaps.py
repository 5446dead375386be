"""Where the facets of two sides that face each other lie over each other: segments in the plane, polygons in space.

A point of the second side belongs to the point of the first that it is projected onto along the normal of the first
facet's corners. Each facet of the first side has coordinates of its own, in which its corners are those of the
reference simplex, and its last coordinate goes along the normal. All products of the basis functions of both sides are
integrated exactly over the intersections of straight facets.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from ..geometry import across, tangents
from ..mesh.nodes import to_barycentric
from ..typing import Array, Integers, Mask
from . import facets
from .facets import Facets, places, slopes
from .scaling import DEFAULT

_STEPS = 12
"""Newton steps to a place in a curved facet; what they have not found by then is far outside."""
_EDGES = [[1, 2], [0, 2], [0, 1]]
"""The ends of the edge opposite to each corner."""


@dataclass(frozen=True, kw_only=True)
class OverlapPoints:
    """Integration points on intersections of facets (p of them).

    Attributes:
        first: number of the first side's facet, (p,).
        second: number of the second side's facet, (p,).
        weights: of the points, m^(d-1), (p,).
        on_first: barycentric coordinates in the first facet, (p, d).
        on_second: in the second facet, (p, d).
    """

    first: Integers
    second: Integers
    weights: Array
    on_first: Array
    on_second: Array


@dataclass(frozen=True, kw_only=True)
class Overlaps:
    """The intersections of facets, cut into segments or triangles (k of them).

    Attributes:
        sides: the facets of both sides.
        first: number of the first side's facet, (k,).
        second: number of the second side's facet, (k,).
        on_first: barycentric coordinates of the corners in the first facet, (k, d, d).
        on_second: in the second facet, (k, d, d).
        covered: whether each vertex of the first side's facets lies over the second side, (f, d).
    """

    sides: tuple[Facets, Facets]
    first: Integers
    second: Integers
    on_first: Array
    on_second: Array
    covered: Mask

    @property
    def areas(self) -> Array:
        """The sizes of their projections along the normals, m^(d-1), (k,)."""
        return _sizes(self.on_first[:, :, 1:]) * self.sides[0].areas[self.first]

    def points(self, degree: int) -> OverlapPoints:
        """The points of a rule that is exact for products of two functions on straight facets.

        Args:
            degree: of the functions.
        """
        rule = facets.rule(self.on_first.shape[1], degree, curved=self.sides[0].curved)
        return self.sampled(*rule, np.arange(len(self.first)))

    def sampled(self, rule: Array, shares: Array, chosen: Integers) -> OverlapPoints:
        """The points of a rule, those of one intersection after those of the other.

        Args:
            rule: barycentric coordinates in an intersection, (q, d).
            shares: their weights, whose sum is 1, (q,).
            chosen: numbers of intersections.
        """
        d, (above, below) = rule.shape[1], self.sides
        first, second = (np.repeat(numbers[chosen], len(rule)) for numbers in (self.first, self.second))
        on_first: Array = (rule @ self.on_first[chosen]).reshape(-1, d)
        on_second: Array = (rule @ self.on_second[chosen]).reshape(-1, d)
        sizes = above.areas[first]
        if above.curved:
            sizes = np.linalg.norm(across(slopes(above.points[first], on_first)), axis=1) / (d - 1)
            own, others = (
                above.own_coordinates(first, of)[:, :, :-1] for of in (above.points[first], below.points[second])
            )
            on_second = _coordinates_of(others, places(own, on_first), on_second)
        return OverlapPoints(
            first=first,
            second=second,
            weights=np.outer(_sizes(self.on_first[chosen][:, :, 1:]), shares).ravel() * sizes,
            on_first=on_first,
            on_second=on_second,
        )


def overlaps(first: Facets, second: Facets) -> Overlaps:
    """The intersections of the facets of two sides, without what lies behind nearer facets.

    Args:
        first: the side onto which is projected.
        second: the other one.
    """
    d = first.dimension
    number, other = _candidates(first, second)
    local = first.own_coordinates(number, second.points[other])
    pair: Integers = np.arange(len(other))
    of_second: Array = np.broadcast_to(np.eye(d), (len(other), d, d))
    if second.curved and d == 3:
        pair, of_second = _parts(second, other)
    outlines = local[:, :d, :-1]
    if second.curved:
        outlines = _curved_outlines(first, number[pair], local[pair, :, :-1], of_second)
    pieces, outline = _clipped(outlines)
    seen = _visible(pieces, outline, number[pair], np.abs(local[pair, :d, -1].mean(axis=1)))
    pieces, outline = pieces[seen], outline[seen]
    on = pair[outline]
    return Overlaps(
        sides=(first, second),
        first=number[on],
        second=other[on],
        on_first=to_barycentric(pieces),
        on_second=_barycentric(outlines[outline], pieces) @ of_second[outline],
        covered=_covered(pieces, number[on], len(first.nodes), DEFAULT.rim if first.curved else DEFAULT.uncovered),
    )


def _candidates(first: Facets, second: Facets) -> tuple[Integers, Integers]:
    """Pairs of facets that may lie over each other: the first side's facets, the second's, (p,) each."""
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


def _balls(side: Facets) -> tuple[Array, Array]:
    """Centres (f, d) and radii (f,) of balls around facets."""
    centres, hull = side.corners.mean(axis=1), side.hull
    return centres, np.linalg.norm(hull - centres[:, None], axis=2).max(axis=1)


def _sizes(simplices: Array) -> Array:
    """Lengths or areas of simplices (n, d, d-1), in parts of that of the reference simplex, (n,)."""
    return np.abs(np.linalg.det(simplices[:, 1:] - simplices[:, :1]))


def _barycentric(simplices: Array, points: Array) -> Array:
    """Barycentric coordinates of points (n, q, d-1) in simplices (n, d, d-1), (n, q, d)."""
    found = (points - simplices[:, :1]) @ np.linalg.inv(simplices[:, 1:] - simplices[:, :1])
    return to_barycentric(found)


def _clipped(outlines: Array) -> tuple[Array, Integers]:
    """What simplices (p, d, d-1) have in common with the reference simplex: parts (n, d, d-1), the number of each."""
    number = np.flatnonzero(np.all((outlines.min(axis=1) < 1.0) & (outlines.max(axis=1) > 0.0), axis=1))
    pieces = np.clip(np.sort(outlines[number], axis=1), 0.0, 1.0)
    if outlines.shape[1] == 3:
        pieces, polygon = _clipped_triangles(outlines[number])
        number = number[polygon]
    solid = _sizes(pieces) > DEFAULT.rounding
    return pieces[solid], number[solid]


def _clipped_triangles(triangles: Array) -> tuple[Array, Integers]:
    """The same in the plane: polygons, cut into triangles about their first corners."""
    ring = to_barycentric(triangles)
    sizes: Integers = np.full(len(ring), 3, dtype=np.int64)
    for side in range(3):
        ring, sizes = _cut(ring, sizes, side)
    polygon, corner = np.nonzero(np.arange(2, ring.shape[1]) < sizes[:, None])
    return np.stack([ring[polygon, 0], ring[polygon, corner + 1], ring[polygon, corner + 2]], axis=1)[:, :, 1:], polygon


def _cut(ring: Array, sizes: Integers, side: int) -> tuple[Array, Integers]:
    """Convex polygons by the barycentric coordinates of their corners (p, v, 3), where one coordinate is positive."""
    number = np.arange(ring.shape[1])
    inside, after = number < sizes[:, None], (number + 1) % np.maximum(sizes, 1)[:, None]
    following = np.take_along_axis(ring, after[:, :, None], axis=1)
    here, there = ring[:, :, side], following[:, :, side]
    crossing = inside & ((here >= 0.0) != (there >= 0.0))
    share = np.divide(here, here - there, out=np.zeros_like(here), where=crossing)
    cut = ring + share[:, :, None] * (following - ring)
    cut[:, :, side] = 0.0
    both = np.stack([ring, cut], axis=2).reshape(len(ring), 2 * len(number), 3)
    kept = np.stack([inside & (here >= 0.0), crossing], axis=2).reshape(both.shape[:2])
    order = np.argsort(~kept, axis=1, kind="stable")[:, : max(int(kept.sum(axis=1).max(initial=0)), 3)]
    return np.take_along_axis(both, order[:, :, None], axis=1), kept.sum(axis=1)


def _visible(pieces: Array, outline: Integers, number: Integers, distance: Array) -> Mask:
    """Which pieces, of outlines on facets (o,) at distances (o,), do not lie behind nearer ones, (n,)."""
    kept, sizes, under = np.ones(len(pieces), dtype=bool), _sizes(pieces), number[outline]
    for crowded in np.flatnonzero(np.bincount(under, weights=sizes, minlength=1) > 1.0 + DEFAULT.uncovered):
        here, nearer = np.flatnonzero(under == crowded), pieces[:0]
        several = np.unique(outline[here])
        for one in several[np.argsort(distance[several], kind="stable")]:
            own = here[outline[here] == one]
            kept[own] = _common(pieces[own], nearer) < 0.5 * sizes[own].sum()
            nearer = np.concatenate([nearer, pieces[own[kept[own]]]])
    return kept


def _common(simplices: Array, others: Array) -> float:
    """What simplices (n, d, d-1) and others (m, d, d-1), of which none overlap, have in common."""
    inverse = np.linalg.inv(others[:, 1:] - others[:, :1])
    local = (simplices[None] - others[:, None, :1]) @ inverse[:, None]
    pieces, number = _clipped(local.reshape(-1, *simplices.shape[1:]))
    return float(np.sum(_sizes(pieces) * _sizes(others)[number // len(simplices)]))


def _covered(pieces: Array, number: Integers, count: int, near: float) -> Mask:
    """Whether pieces on facets (n,) reach each corner of these, (count, d)."""
    d = pieces.shape[1]
    found = np.zeros((count, d), dtype=bool)
    for corner, place in enumerate(np.eye(d)[:, 1:]):
        found[number[np.any(np.linalg.norm(pieces - place, axis=2) <= near, axis=1)], corner] = True
    return found


def _parts(second: Facets, other: Integers) -> tuple[Integers, Array]:
    """Triangles (o) whose edges stand for the curved ones: the pair of each (o,), its corners on the facet (o, 3, 3).

    Two neighbours share a chord. Where a side ends it has to end where the other does: the edge is cut into parts.
    """
    rim = _rim_edges(second)[other]
    pairs, corners = list[Integers](), list[Array]()
    for pattern in np.unique(rim, axis=0):
        here, parts = np.flatnonzero(np.all(rim == pattern, axis=1)), _fan(pattern)
        pairs.append(np.repeat(here, len(parts)))
        corners.append(np.tile(parts, (len(here), 1, 1)))
    return np.concatenate(pairs), np.concatenate(corners)


def _fan(pattern: Mask) -> Array:
    """A facet with edges on the rim (3,) as triangles about its middle, else as itself; corners (s, 3, 3)."""
    if not pattern.any():
        return np.eye(3)[None]
    around: list[Array] = []
    for edge in range(3):
        a, b = np.eye(3)[(edge + 1) % 3], np.eye(3)[(edge + 2) % 3]
        many = DEFAULT.rim_parts if pattern[edge] else 1
        around += [a + (b - a) * step / many for step in range(many)]
    ring = np.array(around)
    return np.stack([np.full_like(ring, 1 / 3), ring, np.roll(ring, -1, axis=0)], axis=1)


def _curved_outlines(first: Facets, number: Integers, local: Array, of_second: Array) -> Array:
    """Simplices of curved facets (o, d, d) in the reference coordinates of those of the first side, (o, d, d-1)."""
    d = first.dimension
    at = places(np.repeat(local, d, axis=0), of_second.reshape(-1, d))
    own = first.own_coordinates(number, first.points[number])[:, :, :-1]
    found = _coordinates_of(np.repeat(own, d, axis=0), at, to_barycentric(at)).reshape(-1, d, d)
    if d == 3:
        found[_rim_edges(first)[number][:, None] & (np.abs(found) < DEFAULT.rim)] = 0.0
    return found[:, :, 1:] / found.sum(axis=2, keepdims=True)


def _rim_edges(side: Facets) -> Mask:
    """Whether no other facet of the side has the edge opposite to each corner, (f, 3)."""
    edges = np.sort(side.nodes[:, _EDGES], axis=2)
    _, which, times = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True, return_counts=True)
    return times[which.ravel()].reshape(-1, 3) == 1


def _coordinates_of(nodes: Array, at: Array, start: Array) -> Array:
    """The barycentric coordinates of places (p, k) in curved facets (p, n, k), or the start where there are none."""
    found, open_ = start.copy(), np.arange(len(start))
    for _ in range(_STEPS):
        left, by = at[open_] - places(nodes[open_], found[open_]), slopes(nodes[open_], found[open_])
        by[np.linalg.det(by) == 0.0] = np.eye(by.shape[1])
        step = np.linalg.solve(by.transpose(0, 2, 1), left[:, :, None])[:, :, 0]
        found[open_] += np.column_stack([-step.sum(axis=1), step])
        open_ = open_[np.abs(left).max(axis=1) > DEFAULT.same]
    d = start.shape[1]
    turned = np.linalg.det(slopes(nodes, found)) * np.linalg.det(nodes[:, 1:d] - nodes[:, :1]) <= 0.0
    lost = np.union1d(open_, np.flatnonzero(turned))
    found[lost] = start[lost]
    return found
