"""Geometry: outlines of plane bodies, the curves that their sides lie on, chains of edges, tangents of normals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .typing import Array, Integers

Point = tuple[float, float]
"""Coordinates, m."""
ROUNDING = 1e-9
"""What is so small beside the numbers that it is made of is none."""


def in_space(vectors: Array) -> Array:
    """Vectors (n, d) with zeros for what they lack of three components."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def units(vectors: Array) -> Array:
    """The unit vectors along vectors, both (n, d)."""
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


class Curve(Protocol):
    """What a side that is not straight lies on, in d dimensions."""

    def nearest(self, x: Array) -> Array:
        """The points of the curve nearest to the points x, both of shape (n, d), m."""

    def moved(self, origin: Array, rotation: Array) -> Curve:
        """The curve turned about the origin of coordinates, and then moved.

        Args:
            origin: where the origin of coordinates comes to lie, m, (d,).
            rotation: (d, d).
        """


@dataclass(frozen=True, slots=True)
class CircularArc:
    """A circle that a side lies on.

    Attributes:
        centre: m.
        radius: m.
    """

    centre: Point
    radius: float

    def nearest(self, x: Array) -> Array:
        """The points of the circle nearest to the points x, both of shape (n, 2), m."""
        away = x - self.centre
        return self.centre + self.radius * units(away)

    def moved(self, origin: Array, rotation: Array) -> CircularArc:
        """The circle turned about the origin of coordinates, and then moved.

        Args:
            origin: where the origin of coordinates comes to lie, m, (2,).
            rotation: (2, 2).
        """
        x, y = rotation @ self.centre + origin
        return CircularArc((float(x), float(y)), self.radius)


def _swept(p: Point, q: Point, centre: Point | None) -> float:
    """½ ∫ x dy - y dx from p to q, along a line or an arc of less than half a circle: what it adds to an area, m²."""
    x, y = centre or (0.0, 0.0)
    (a, b), (c, d) = (p[0] - x, p[1] - y), (q[0] - x, q[1] - y)
    if centre is None:
        return 0.5 * (a * d - b * c)
    turned = np.arctan2(a * d - b * c, a * c + b * d)
    return float(0.5 * (np.hypot(a, b) ** 2 * turned + x * (d - b) - y * (c - a)))


@dataclass(frozen=True, slots=True)
class Outline:
    """The closed boundary of a plane body, counterclockwise, with the mesh size wanted at its corners.

    Attributes:
        points: the corners, m.
        sides: name and centre of the edge from each corner to the next; a centre (m) makes it an arc, None a line.
        sizes: edge length of the cells at each corner, m.
    """

    points: Sequence[Point]
    sides: Sequence[tuple[str, Point | None]]
    sizes: Sequence[float]

    @classmethod
    def polygon(cls, points: Sequence[Point], names: Sequence[str], size: float) -> Outline:
        """A polygon with cells of one size.

        Args:
            points: the corners, m, counterclockwise.
            names: of the side from each corner to the next.
            size: edge length of the cells, m.
        """
        return cls(points, [(name, None) for name in names], [size] * len(points))

    @property
    def box_area(self) -> float:
        """Area of the box around the corners, m²."""
        x, y = zip(*self.points, strict=True)
        return (max(x) - min(x)) * (max(y) - min(y))

    @property
    def extent(self) -> float:
        """The longer edge of the box around the corners, m."""
        return max(max(along) - min(along) for along in zip(*self.points, strict=True))

    @property
    def area(self) -> float:
        """Area within, m²."""
        ends = zip(self.points, [*self.points[1:], self.points[0]], self.sides, strict=True)
        return sum(_swept(p, q, centre) for p, q, (_, centre) in ends)

    def in_units(self, unit: float, digits: int) -> Outline:
        """The outline with its lengths in units of one of them, rounded.

        Args:
            unit: m.
            digits: decimals of the lengths.
        """

        def at(p: Point) -> Point:
            return round(p[0] / unit, digits), round(p[1] / unit, digits)

        sides = [(name, None if centre is None else at(centre)) for name, centre in self.sides]
        return Outline([at(p) for p in self.points], sides, [round(size / unit, digits) for size in self.sizes])

    def arcs(self) -> dict[str, CircularArc]:
        """The curved sides by name."""
        starts = zip(self.points, self.sides, strict=True)
        return {
            name: CircularArc(c, float(np.hypot(p[0] - c[0], p[1] - c[1]))) for p, (name, c) in starts if c is not None
        }


def spot(point: Array) -> str:
    """A point in words, for messages: its coordinates with six digits, in brackets.

    Args:
        point: m, (d,).
    """
    rounding = ROUNDING * float(np.abs(point).max())
    return f"({', '.join(f'{c if abs(c) > rounding else 0.0:.6g}' for c in point)})"


def chains(edges: Integers, rank: Integers | None = None) -> list[Integers]:
    """Follow oriented edges from end to end.

    Open chains come first, since a walk that begins inside of one would cut it in two.

    Args:
        edges: the two vertices of each edge, each edge once, (k, 2).
        rank: of each vertex, (n,): a closed chain begins at its vertex of lowest rank; without it, at the vertex that
            comes first in the edges.

    Returns:
        The vertices of each chain in order; a closed one ends with the vertex that it begins with.
    """
    onwards: dict[int, list[int]] = {}
    starts, ends = (list(map(int, column)) for column in edges.T)
    for a, b in zip(starts, ends, strict=True):
        onwards.setdefault(a, []).append(b)
    inner = set(ends)
    found = [_walk(start, onwards) for start in [a for a in onwards if a not in inner]]
    while onwards:
        start = next(iter(onwards)) if rank is None else min(onwards, key=lambda a: int(rank[a]))
        found.append(_walk(start, onwards))
    return found


def _walk(start: int, onwards: dict[int, list[int]]) -> Integers:
    """Along the edges as far as they lead; those that were walked are taken out."""
    chain = [start]
    while (following := onwards.get(chain[-1])) is not None:
        if len(following) == 1:
            del onwards[chain[-1]]
        chain.append(following.pop())
    return np.array(chain, dtype=np.int64)


def across(slopes: Array) -> Array:
    """Vectors along the normals, their lengths what a facet has of length or twice its area there, (p, d).

    Args:
        slopes: in d dimensions, (p, d-1, d).
    """
    if slopes.shape[2] == 2:
        return np.column_stack([slopes[:, 0, 1], -slopes[:, 0, 0]])
    return np.cross(slopes[:, 0], slopes[:, 1])


def tangents(normals: Array) -> Array:
    """The unit tangents of outward normals, (m, d-1, d), that all results refer to.

    In 2D the one whose larger component is positive; in 3D t1 is the projected x-axis (the y-axis where n is within
    45° of x) and t2 = n x t1.

    Args:
        normals: (m, d).
    """
    if normals.shape[1] == 2:
        t = np.column_stack([-normals[:, 1], normals[:, 0]])
        rows = np.arange(len(t))
        return (t * np.sign(t[rows, np.argmax(np.abs(t), axis=1)])[:, None])[:, None, :] + 0.0
    steep = np.abs(normals[:, 0]) > np.sqrt(0.5)
    axis = np.where(steep[:, None], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    t1 = units(axis - np.sum(axis * normals, axis=1)[:, None] * normals)
    return np.stack([t1, np.cross(normals, t1)], axis=1) + 0.0
