"""Facets, straight or curved through their nodes: places, slopes and quadrature on them, their own coordinates.

The vertices of a round side lie on a quadric. Normals that are averaged over unequal facets resist a rotation, or a
motion along an axis, that the side itself does not; those of its quadric are exactly orthogonal to it.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np
from dolfinx import fem

from .. import compat
from ..geometry import ROUNDING, across, units
from ..mesh import facets, nodes
from ..mesh.domain import DEFAULT
from ..typing import Array, Entities, Integers
from . import spaces

_DEGREE = 12
"""Degree of the quadrature on curved facets: areas are square roots of polynomials, nearly constant ones."""


def is_curved(space: fem.FunctionSpace) -> bool:
    """Whether the space lives on curved cells."""
    return compat.geometry_degree(space.mesh) > 1


def rule(dimension: int, degree: int, *, curved: bool) -> tuple[Array, Array]:
    """A quadrature on facets: barycentric points (q, d), and their weights, whose sum is 1 (q,).

    Args:
        dimension: of the space.
        degree: of the functions of which products are integrated exactly on straight facets.
        curved: whether facets are curved.
    """
    return nodes.quadrature(dimension, _DEGREE if curved else 2 * degree)


def samples(space: fem.FunctionSpace, facets: Entities) -> tuple[Array, Array, Array]:
    """Quadrature points of facets.

    Args:
        space: of the displacements.
        facets: local facets (f of them).

    Returns:
        The points (q of them), m, (f, q, d), their weights, whose sum is the facet's size, (f, q), and the
        displacement's basis functions there, (q, nodes).
    """
    d = space.mesh.geometry.dim
    at = nodes.points(space)[nodes.facet_nodes(space, facets)][:, :, :d]
    where, weights = rule(d, nodes.degree(space), curved=is_curved(space))
    every = np.repeat(at, len(where), axis=0), np.tile(where, (len(at), 1))
    sizes = np.linalg.norm(across(slopes(*every)), axis=1).reshape(len(at), len(where)) / (d - 1)
    functions = spaces.simplex_functions(nodes.degree(space), where, spaces.edge_share(space))
    return places(*every).reshape(len(at), len(where), d), weights * sizes, functions


def function_integrals(space: fem.FunctionSpace, facets: Entities) -> Array:
    """The integrals of the basis functions over facets, by their nodes, m or m², (f, nodes).

    Args:
        space: of the displacements.
        facets: local facets (f of them).
    """
    _, weights, functions = samples(space, facets)
    return weights @ functions


def places(nodes: Array, barycentric: Array) -> Array:
    """Where points are, (p, k).

    Args:
        nodes: of the facet of each point, corners first, then midpoints of edges in the order of basix, (p, n, k).
        barycentric: the points, (p, d).
    """
    degree = 1 if nodes.shape[1] == barycentric.shape[1] else 2
    return np.einsum("pn,pnk->pk", spaces.simplex_functions(degree, barycentric), nodes)


def slopes(nodes: Array, barycentric: Array) -> Array:
    """The derivatives of the place by all barycentric coordinates but the first, (p, d-1, k).

    Args:
        nodes: as for :func:`places`.
        barycentric: the points, (p, d).
    """
    d = barycentric.shape[1]
    if nodes.shape[1] == d:
        return nodes[:, 1:] - nodes[:, :1]
    functions = spaces.quadratic_functions(1, barycentric)[1:]
    return np.einsum("jpn,pnk->pjk", functions, nodes)


@dataclass(frozen=True, kw_only=True)
class Facets:
    """The facets of one side, the same on all ranks (f of them).

    Attributes:
        nodes: global numbers of their nodes, corners first, (f, n).
        points: these nodes, those of curved sides on their curves, m, (f, n, d).
        normals: outward unit normals of the corners' segments or triangles, (f, d).
        share: of an edge's function that goes to each of its ends (:func:`.spaces.edge_share`).
        curved: whether they are curved through their nodes, else segments or triangles.
    """

    nodes: Integers
    points: Array
    normals: Array
    share: float = 0.0
    curved: bool = False

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.points.shape[2]

    @property
    def degree(self) -> int:
        """The degree of the elements."""
        return 1 if self.points.shape[1] == self.dimension else 2

    @property
    def corners(self) -> Array:
        """The vertices, m, (f, d, d)."""
        return self.points[:, : self.dimension]

    @property
    def edges(self) -> list[list[int]]:
        """The ends of the edges whose midpoints are nodes, in their order."""
        return nodes.edges(self.dimension) if self.degree == 2 else []

    def _middles(self, share: float, weight: float) -> Array:
        """The nodes, of each midpoint that less a share of both ends, times a weight, (f, n, d)."""
        found = self.points.copy()
        for node, ends in enumerate(self.edges, self.dimension):
            found[:, node] = weight * (found[:, node] - share * found[:, ends].sum(axis=1))
        return found

    @property
    def hull(self) -> Array:
        """Points whose convex hull holds each facet, curved or not, m, (f, n, d): Bézier's points."""
        return self._middles(0.25, 2.0)

    @property
    def positions(self) -> Array:
        """The coefficients of the positions of the nodes, m, (f, n, d)."""
        return self._middles(self.share, 1 / (1 - 2 * self.share))

    def functions(self, barycentric: Array) -> Array:
        """The basis functions of the nodes at points (..., d) of a facet, (..., n)."""
        flat = spaces.simplex_functions(self.degree, barycentric.reshape(-1, self.dimension), self.share)
        return flat.reshape(*barycentric.shape[:-1], -1)

    @functools.cached_property
    def areas(self) -> Array:
        """Lengths or areas of the corners' segments or triangles, m^(d-1), (f,)."""
        return facets.areas(self.corners)

    @property
    def width(self) -> float:
        """The longest edge, m."""
        return float(np.max(np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=1), axis=2)))

    @functools.cached_property
    def _frames(self) -> Array:
        """Distances from a facet's first corner times these are its own coordinates, (f, d, d)."""
        sides = self.corners[:, 1:] - self.corners[:, :1]
        return np.linalg.inv(np.concatenate([sides, self.normals[:, None]], axis=1))

    def own_coordinates(self, facets: Integers, points: Array) -> Array:
        """Points in the coordinates of facets, (p, n, d).

        Args:
            facets: their numbers, (p,).
            points: for each facet, (p, n, d).
        """
        return np.einsum("pvi,pij->pvj", points - self.corners[facets, :1], self._frames[facets])

    def normals_at(self, facets: Integers, barycentric: Array) -> Array:
        """The outward unit normals at points of facets, (p, d).

        Args:
            facets: their numbers, (p,).
            barycentric: the point of each, (p, d).
        """
        return turned(across(slopes(self.points[facets], barycentric)), self.normals[facets])


def outward(corners: Array, inner: Array) -> Array:
    """The unit normals of segments or triangles away from points inside, (f, d).

    Args:
        corners: of the facets, (f, d, d).
        inner: points inside, (f, d).
    """
    return turned(across(corners[:, 1:] - corners[:, :1]), corners[:, 0] - inner)


def turned(vectors: Array, towards: Array) -> Array:
    """The unit vectors along vectors, or against them, that look to the side of others, (n, d).

    Args:
        vectors: not zero, (n, d).
        towards: the others, (n, d).
    """
    return units(vectors * np.sign(np.sum(vectors * towards, axis=1, keepdims=True)))


@dataclass(frozen=True)
class Quadric:
    """Where h·Qh = 0; h is the distance from an origin in parts of a length, and 1 as the last component.

    Attributes:
        origin: m, (d,).
        length: m.
        matrix: Q, symmetric, (d+1, d+1).
    """

    origin: Array
    length: float
    matrix: Array

    def _at(self, points: Array) -> tuple[Array, Array]:
        h = np.pad((points - self.origin) / self.length, ((0, 0), (0, 1)), constant_values=1.0)
        return h, h @ self.matrix

    def slopes(self, points: Array) -> Array:
        """Vectors along the normals through points, both (p, d)."""
        return self._at(points)[1][:, :-1]

    def distances(self, points: Array, directions: Array) -> Array:
        """How far the surface is from points, m, (p,).

        Args:
            points: m, (p, d).
            directions: unit vectors along which it is looked for, (p, d).
        """
        (h, slopes), ahead = self._at(points), np.pad(directions, ((0, 0), (0, 1)))
        value, steep, bend = np.sum([h * slopes, ahead * slopes, ahead @ self.matrix * ahead], axis=2)
        root = np.sqrt(np.maximum(steep**2 - bend * value, 0.0))
        return -self.length * value / (steep + np.copysign(root, steep))


def quadric_of(side: Facets) -> Quadric | None:
    """The quadric that all vertices of a side lie on: a circle, or a cylinder along which its facets are, else any.

    Args:
        side: its facets.

    Returns:
        None where there is none or several, where facets turn from one to the next as at an edge, or of a plane, whose
        facets have its normal.
    """
    if np.all(np.ptp(side.normals, axis=0) <= ROUNDING):
        return None
    d, corners = side.dimension, side.corners.reshape(-1, side.dimension)
    facing, places = np.repeat(side.normals, d, axis=0), np.unique(corners, axis=0)
    axis = np.linalg.eigh(np.cov(facing.T))[1][:, : d - 2]
    products = np.array([np.outer(a, b) + np.outer(b, a) for a, b in combinations_with_replacement(np.eye(d + 1), 2)])
    linear = products[products[:, -1].any(axis=1)]
    across = np.pad(np.eye(d) - axis @ axis.T, (0, 1))
    for kinds in (np.concatenate([across[None], linear]), products):
        one = Quadric(places.mean(axis=0), float(np.ptp(places)), kinds[0])
        h, _ = one._at(places)
        _, sizes, fits = np.linalg.svd(np.einsum("pi,kij,pj->pk", h, kinds, h), full_matrices=False)
        if len(places) >= len(kinds) and sizes[-1] <= ROUNDING * sizes[0] < sizes[-2]:
            one = replace(one, matrix=np.tensordot(fits[-1], kinds, 1))
            if np.all(np.sum(turned(one.slopes(corners), facing) * facing, axis=1) > math.cos(DEFAULT.outline_turn)):
                return one
    return None
