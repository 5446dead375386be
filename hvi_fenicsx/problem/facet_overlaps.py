"""Where the facets of two sides that face each other lie over each other: intervals in the plane.

A point of the second side belongs to the point of the first that it is projected onto along the first facet's normal.
All products of the basis functions of both sides are integrated exactly over the intersections of facets.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import basix
import numpy as np
from dolfinx import fem

from .. import compat
from ..mesh import nodes
from ..typing import Array, Entities, Integers, Mask
from . import spaces
from .scaling import DEFAULT

_DEGREE = 12
"""Degree of the quadrature: areas are square roots of polynomials, nearly constant ones."""


def is_curved(space: fem.FunctionSpace) -> bool:
    """Whether the space lives on curved cells."""
    return compat.geometry_degree(space.mesh) > 1


def samples(space: fem.FunctionSpace, facets: Entities) -> tuple[Array, Array, Array]:
    """Quadrature points of facets of curved cells.

    Args:
        space: of degree 2.
        facets: local facets (f of them).

    Returns:
        The points (q of them), m, (f, q, d), their weights, whose sum is the facet's size, (f, q), and the
        displacement's basis functions there, (q, nodes).
    """
    d = space.mesh.geometry.dim
    at = nodes.points(space)[nodes.facet_nodes(space, facets)][:, :, :d]
    return from_nodes(at, spaces.edge_share(space))


def from_nodes(at: Array, share: float) -> tuple[Array, Array, Array]:
    """The same, for facets by their nodes.

    Args:
        at: the nodes, corners first, then midpoints of edges in the order of basix, m, (f, n, d).
        share: of an edge's function that goes to each of its ends (:func:`.spaces.edge_share`).
    """
    kind = {2: basix.CellType.interval, 3: basix.CellType.triangle}[at.shape[2]]
    places, weights = (np.asarray(part, dtype=np.float64) for part in basix.make_quadrature(kind, _DEGREE))
    element = basix.create_element(basix.ElementFamily.P, kind, 2, basix.LagrangeVariant.gll_warped)
    table = np.asarray(element.tabulate(1, places))[:, :, :, 0]
    slopes = np.einsum("iqn,fnd->fqid", table[1:], at)
    gram = np.einsum("fqid,fqjd->fqij", slopes, slopes)
    barycentric = np.column_stack([1 - places.sum(axis=1), places])
    functions = spaces.simplex_functions(2, barycentric, share)
    return np.einsum("qn,fnd->fqd", table[0], at), weights * np.sqrt(np.linalg.det(gram)), functions


@dataclass(frozen=True, kw_only=True)
class Facets:
    """The facets of one side, the same on all ranks (f of them).

    Attributes:
        nodes: global numbers of their nodes, corners first, (f, n).
        points: these nodes, those of curved sides on their curves, m, (f, n, d).
        normals: outward unit normals of the corners' segments or triangles, (f, d).
        share: of an edge's function that goes to each of its ends (:func:`.spaces.edge_share`).
    """

    nodes: Integers
    points: Array
    normals: Array
    share: float = 0.0

    @property
    def degree(self) -> int:
        """The degree of the elements."""
        return 1 if self.points.shape[1] == self.points.shape[2] else 2

    @property
    def corners(self) -> Array:
        """The vertices, m, (f, d, d)."""
        return self.points[:, : self.points.shape[2]]

    @property
    def edges(self) -> list[list[int]]:
        """The ends of the edges whose midpoints are nodes, in their order."""
        kind = basix.CellType[_KINDS[self.points.shape[2]]]
        found: list[list[int]] = basix.topology(kind)[1]
        return found if self.degree == 2 else []

    @property
    def hull(self) -> Array:
        """Points whose convex hull holds each facet, curved or not, m, (f, n, d): Bézier's points."""
        found = self.points.copy()
        for node, ends in enumerate(self.edges, found.shape[2]):
            found[:, node] = 2 * found[:, node] - found[:, ends].sum(axis=1) / 2
        return found

    @property
    def positions(self) -> Array:
        """The coefficients of the positions of the nodes, m, (f, n, d)."""
        found = self.points.copy()
        for node, ends in enumerate(self.edges, found.shape[2]):
            found[:, node] = (found[:, node] - self.share * found[:, ends].sum(axis=1)) / (1 - 2 * self.share)
        return found

    def functions(self, barycentric: Array) -> Array:
        """The basis functions of the nodes at points (..., d) of a facet, (..., n)."""
        flat = spaces.simplex_functions(self.degree, barycentric.reshape(-1, barycentric.shape[-1]), self.share)
        return flat.reshape(*barycentric.shape[:-1], -1)

    @property
    def areas(self) -> Array:
        """Lengths or areas, m^(d-1), (f,)."""
        sides = self.corners[:, 1:] - self.corners[:, :1]
        return np.sqrt(np.linalg.det(sides @ sides.transpose(0, 2, 1))) / sides.shape[1]

    @property
    def width(self) -> float:
        """The longest edge, m."""
        return float(np.max(np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=1), axis=2)))


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
        first: number of the first side's facet, (k,).
        second: number of the second side's facet, (k,).
        areas: m^(d-1), (k,).
        on_first: barycentric coordinates of the corners in the first facet, (k, d, d).
        on_second: in the second facet, (k, d, d).
        covered: whether each vertex of the first side's facets lies over the second side, (f, d).
    """

    first: Integers
    second: Integers
    areas: Array
    on_first: Array
    on_second: Array
    covered: Mask

    def points(self, degree: int) -> OverlapPoints:
        """The points of a rule that is exact for products of two functions.

        Args:
            degree: of the functions.
        """
        made: tuple[Any, Any] = basix.make_quadrature(basix.CellType[_KINDS[self.on_first.shape[1]]], 2 * degree)
        rule = np.column_stack([1.0 - made[0].sum(axis=1), made[0]])
        return self.sampled(rule, made[1] / made[1].sum(), np.arange(len(self.first)))

    def sampled(self, rule: Array, shares: Array, chosen: Integers) -> OverlapPoints:
        """The points of a rule, those of one intersection after those of the other.

        Args:
            rule: barycentric coordinates in an intersection, (q, d).
            shares: their weights, whose sum is 1, (q,).
            chosen: numbers of intersections.
        """
        d = rule.shape[1]
        return OverlapPoints(
            first=np.repeat(self.first[chosen], len(rule)),
            second=np.repeat(self.second[chosen], len(rule)),
            weights=np.asarray(np.outer(self.areas[chosen], shares).ravel(), dtype=np.float64),
            on_first=(rule @ self.on_first[chosen]).reshape(-1, d),
            on_second=(rule @ self.on_second[chosen]).reshape(-1, d),
        )


_KINDS = {2: "interval", 3: "triangle"}
"""Facets by dimension."""


def in_plane(first: Facets, second: Facets) -> Overlaps:
    """The intersections of the facets of two sides in the plane.

    Args:
        first: the side onto which is projected.
        second: the other one.
    """
    pieces = [np.empty((0, 6))]
    covered = np.zeros((len(first.nodes), 2), dtype=bool)
    for number in range(len(first.nodes)):
        found = _nearest(_intervals(first, second, number))
        pieces.append(np.column_stack([np.full(len(found), number), found]))
        begin, end = found[:, 1].min(initial=np.inf), found[:, 2].max(initial=-np.inf)
        covered[number] = begin <= DEFAULT.uncovered, end >= 1.0 - DEFAULT.uncovered
    whole = np.vstack(pieces)
    return _pieces(first, whole, covered)


def _intervals(first: Facets, second: Facets, number: int) -> Array:
    """Facets over one of the first side: number, begin, end on it, and where these ends are on the facet, (k, 5)."""
    start, end = first.corners[number]
    length, normal = np.linalg.norm(end - start), first.normals[number]
    facing = np.flatnonzero(second.normals @ normal < -DEFAULT.facing)
    along = (second.corners[facing] - start) @ (end - start) / length**2
    low, high = np.maximum(along.min(axis=1), 0.0), np.minimum(along.max(axis=1), 1.0)
    over = high - low > DEFAULT.rounding
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


def _pieces(first: Facets, found: Array, covered: Mask) -> Overlaps:
    """Intervals (first facet, second facet, begin, end, both on the second facet) as intersections."""
    number, x, y = found[:, 0].astype(np.int64), found[:, 2:4], found[:, 4:6]
    return Overlaps(
        first=number,
        second=found[:, 1].astype(np.int64),
        areas=first.areas[number] * (x[:, 1] - x[:, 0]),
        on_first=np.stack([1.0 - x, x], axis=2),
        on_second=np.stack([1.0 - y, y], axis=2),
        covered=covered,
    )
