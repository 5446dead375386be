"""Curved sides by facets of second order, as a mesh file has them: the points nearest to others.

The mesh of a domain has straight cells; those of degree 2 are made of it (:mod:`.curved_cells`). A side of second
order tells where its nodes and refined vertices belong.
"""

from __future__ import annotations

from dataclasses import dataclass

import basix
import numpy as np
from scipy.spatial import KDTree

from ..typing import Array, Integers
from . import point_location

_ROUNDING = 1e-12
"""Distance from the middle of an edge, over the size of the side, that is rounding."""
_STEPS = 12
"""Gauss-Newton steps from the projection onto the straight facet; the bend of a facet is a small part of its size."""


@dataclass(frozen=True)
class CurvedFacets:
    """A side of k facets of second order in d dimensions.

    Attributes:
        points: the nodes of each facet, corners first, then midpoints of edges in the order of basix, m, (k, n, d).
    """

    points: Array

    def nearest(self, x: Array) -> Array:
        """The points of the side nearest to the points x, both (m, d), m; of the middle of an edge its own node.

        So an edge between two sides stays on both.
        """
        if not len(x):
            return np.array(x, dtype=np.float64)
        facet, point = self._pairs(x)
        found, away = self._projected(facet, x[point])
        order = np.argsort(-away, kind="stable")  # of several facets of one point, the last one stays
        result = np.array(x, dtype=np.float64)
        result[point[order]] = found[order]
        straight, own = self._middles()
        away, number = KDTree(straight).query(x)
        same = away <= _ROUNDING * np.linalg.norm(np.ptp(self.points, axis=(0, 1)))
        result[same] = own[number[same]]
        return result

    def moved(self, origin: Array, rotation: Array) -> CurvedFacets:
        """The side turned about the origin of coordinates, and then moved.

        Args:
            origin: where the origin of coordinates comes to lie, m, (d,).
            rotation: (d, d).
        """
        return CurvedFacets(self.points @ rotation.T + origin)

    def _middles(self) -> tuple[Array, Array]:
        """The middles of the edges if they were straight, and their nodes, (e, d) both."""
        d = self.points.shape[2]
        kind = {2: basix.CellType.interval, 3: basix.CellType.triangle}[d]
        ends = np.array(basix.topology(kind)[1])
        return self.points[:, ends].mean(axis=2).reshape(-1, d), self.points[:, d:].reshape(-1, d)

    def _pairs(self, x: Array) -> tuple[Integers, Integers]:
        """Facets, and points that may be nearest to them; all facets for points that are near none."""
        centres = self.points.mean(axis=1)
        radii = 1.5 * np.linalg.norm(self.points - centres[:, None], axis=2).max(axis=1)
        near = KDTree(x).query_ball_point(centres, radii, return_sorted=True)
        facet = np.repeat(np.arange(len(near)), [len(one) for one in near])
        point = np.concatenate([np.empty(0), *near]).astype(np.int64)
        lost = np.setdiff1d(np.arange(len(x)), point)
        everything = np.arange(len(centres))
        facet = np.concatenate([facet, np.tile(everything, len(lost))])
        return facet, np.concatenate([point, np.repeat(lost, len(centres))])

    def _projected(self, facet: Integers, x: Array) -> tuple[Array, Array]:
        """The points of facets nearest to points (p, d), and how far they are away, (p,)."""
        d = x.shape[1]
        kind = {2: basix.CellType.interval, 3: basix.CellType.triangle}[d]
        element = basix.create_element(basix.ElementFamily.P, kind, 2, basix.LagrangeVariant.gll_warped)
        nodes = self.points[facet]
        place = point_location.clipped(point_location.barycentric_weights(nodes[:, :d], x))[:, 1:]
        for _ in range(_STEPS):
            found, slopes = _at(element, nodes, place)
            gram = np.einsum("ipd,jpd->pij", slopes, slopes)
            right = np.einsum("ipd,pd->pi", slopes, x - found)
            place = place + np.linalg.solve(gram, right[:, :, None])[:, :, 0]
            place = point_location.clipped(np.column_stack([1 - place.sum(axis=1), place]))[:, 1:]
        found, _ = _at(element, nodes, place)
        return found, np.linalg.norm(found - x, axis=1)


def _at(element: basix.finite_element.FiniteElement, nodes: Array, place: Array) -> tuple[Array, Array]:
    """Points of facets (p, d) and their derivatives by the reference coordinates (d-1, p, d)."""
    table = np.asarray(element.tabulate(1, np.ascontiguousarray(place)))[:, :, :, 0]
    values = np.einsum("ipn,pnd->ipd", table, nodes)
    return values[0], values[1:]
