"""The outline of a plane mesh with fewer vertices: its boundary, and the lines between its regions.

It is cut into chains of edges at corners, where sides end and where regions meet. In each chain only every n-th vertex
is kept, so that where the mesh is finer, the outline stays finer.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from ..typing import Array, Integers
from .thresholds import DEFAULT, Thresholds

NONE = -1
"""Stands for no side, or no region."""


@dataclass(frozen=True)
class HalfEdges:
    """Edges of cells that may lie on the outline, each with its cell on the left.

    Attributes:
        ends: vertex numbers, (k, 2).
        points: their coordinates, (k, 2, 2).
        region: number of the region, or NONE, (k,).
        side: number of the side, or NONE, (k,).
    """

    ends: Integers
    points: Array
    region: Integers
    side: Integers

    @classmethod
    def joined(cls, parts: Sequence[HalfEdges]) -> HalfEdges:
        """The edges of all ranks, without those between two ranks' cells; the order does not depend on the ranks."""
        ends, points = np.concatenate([p.ends for p in parts]), np.concatenate([p.points for p in parts])
        region, side = np.concatenate([p.region for p in parts]), np.concatenate([p.side for p in parts])
        labels = np.column_stack([np.sort(ends, axis=1), region, side])
        _, which, counts = np.unique(labels, axis=0, return_inverse=True, return_counts=True)
        kept = (counts[which.ravel()] == 1) | (side != NONE)
        ends = _by_place(ends[kept], points[kept])
        order = np.lexsort(ends.T)
        return cls(ends[order], points[kept][order], region[kept][order], side[kept][order])


def _by_place(ends: Integers, points: Array) -> Integers:
    """Vertices numbered anew from left to right; those at one place (on a crack) by their old numbers."""
    numbers, first, which = np.unique(ends, return_index=True, return_inverse=True)
    x, y = points.reshape(-1, 2)[first].T
    new = np.empty(len(numbers), dtype=np.int64)
    new[np.lexsort((numbers, y, x))] = np.arange(len(numbers))
    return new[which].reshape(ends.shape)


@dataclass(frozen=True)
class Chain:
    """Edges between two joints.

    Attributes:
        vertices: all vertices, in order.
        side: number of the side, or NONE.
        left: region to the left, None where there is no cell.
        right: region to the right, likewise.
    """

    vertices: list[int]
    side: int
    left: int | None
    right: int | None


@dataclass(frozen=True)
class Face:
    """A piece of a region.

    Attributes:
        region: number of the region, or NONE.
        rings: the vertices along its boundary, then along each of its holes, each once.
        area: within.
    """

    region: int
    rings: list[list[int]]
    area: float


@dataclass(frozen=True)
class ThinnedOutline:
    """Chains with fewer vertices, and the faces between them.

    Attributes:
        chains: the chains.
        faces: the faces.
        places: coordinates by vertex number.
    """

    chains: list[Chain]
    faces: list[Face]
    places: Mapping[int, Array]


def trace(edges: HalfEdges, factor: float, thresholds: Thresholds = DEFAULT) -> ThinnedOutline | None:
    """The outline with fewer vertices.

    Args:
        edges: of all ranks.
        factor: about how many edges become one.
        thresholds: which vertices are kept, and how far the area may differ.

    Returns:
        None where the outline touches itself (gmsh would work on crossing edges for ever), where the area differs too
        much, or where a side ends inside of a body.
    """
    places = dict(zip(edges.ends.ravel().tolist(), edges.points.reshape(-1, 2), strict=True))
    chains = _chains(edges, places, thresholds)
    thinned = [_thinned(c, places, factor, thresholds) for c in chains]
    if _ends_or_meets_itself(chains) or _touches_itself(thinned, places):
        return None
    before, after = _faces(chains, places), _faces(thinned, places)
    whole = sum(face.area for face in before)
    if abs(sum(face.area for face in after) - whole) >= thresholds.remeshed_size * whole:
        return None
    return ThinnedOutline(thinned, after, places)


def _ends_or_meets_itself(chains: Sequence[Chain]) -> bool:
    """Whether a side ends inside of a body, or the boundary of a region comes to a vertex twice."""
    ends = [(region, c.vertices[0 if way else -1]) for c in chains for region, way in ((c.left, 1), (c.right, 0))]
    starts = [end for end in ends if end[0] is not None]
    return any(c.left == c.right for c in chains) or len(set(starts)) < len(starts)


def _touches_itself(chains: Sequence[Chain], places: Mapping[int, Array]) -> bool:
    """Whether two edges meet elsewhere than in a vertex of both."""
    segments = [[places[a], places[b]] for c in chains for a, b in pairwise(c.vertices)]
    return not shapely.MultiLineString(segments).is_simple


def _faces(chains: Sequence[Chain], places: Mapping[int, Array]) -> list[Face]:
    """What the chains enclose, where there are cells."""
    number = {tuple(place): vertex for vertex, place in places.items()}
    regions: dict[tuple[int, int], int | None] = {}
    for chain in chains:
        for a, b in pairwise(chain.vertices):
            regions |= {(a, b): chain.left, (b, a): chain.right}
    lines = [shapely.LineString([places[v] for v in chain.vertices]) for chain in chains]
    found = []
    for polygon in map(shapely.geometry.polygon.orient, shapely.polygonize(lines).geoms):
        rings = [[number[xy] for xy in ring.coords[:-1]] for ring in (polygon.exterior, *polygon.interiors)]
        region = regions[rings[0][0], rings[0][1]]  # counterclockwise: the face lies to the left
        if region is not None:
            found.append(Face(region, rings, polygon.area))
    return found


Label = tuple[int, int | None, int | None]
"""Side, region to the left, region to the right of an edge."""


def _chains(edges: HalfEdges, places: Mapping[int, Array], thresholds: Thresholds) -> list[Chain]:
    """The outline in chains of edges that are labelled alike, from corner to corner; a chain may be closed."""
    labels = _labels(edges)
    neighbours: dict[int, list[int]] = defaultdict(list)
    for a, b in labels:
        neighbours[a].append(b)
    joints = {
        v
        for v, around in neighbours.items()
        if len(around) != 2
        or labels[around[0], v] != labels[v, around[1]]
        or _turn(places, around[0], v, around[1]) > thresholds.outline_turn
    }
    found: list[Chain] = []
    seen: set[tuple[int, int]] = set()
    for start in [*sorted(joints), *sorted(set(neighbours) - joints)]:
        for second in neighbours[start]:
            untouched = start in joints or not any((start, n) in seen for n in neighbours[start])
            if untouched and (start, second) not in seen:
                path = _walk(start, second, neighbours, joints)
                seen |= {edge for a, b in pairwise(path) for edge in ((a, b), (b, a))}
                found.append(Chain(path, *labels[path[0], path[1]]))
    return found


def _labels(edges: HalfEdges) -> dict[tuple[int, int], Label]:
    """The label of each edge, in both directions."""
    regions: dict[tuple[int, int], int] = {}
    sides: dict[tuple[int, int], int] = {}
    for a, b, region, side in np.column_stack([edges.ends, edges.region, edges.side]):
        regions[int(a), int(b)] = int(region)
        for way in ((int(a), int(b)), (int(b), int(a))):
            sides[way] = max(int(side), sides.get(way, NONE))
    return {(a, b): (side, regions.get((a, b)), regions.get((b, a))) for (a, b), side in sides.items()}


def _walk(start: int, second: int, neighbours: Mapping[int, list[int]], joints: set[int]) -> list[int]:
    """The vertices from one joint to the next, or around a closed chain."""
    path = [start, second]
    while path[-1] not in joints and path[-1] != start:
        path.append(next(v for v in neighbours[path[-1]] if v != path[-2]))
    return path


def _turn(places: Mapping[int, Array], before: int, at: int, after: int) -> float:
    """The angle (radian) by which the outline turns at a vertex, 0 to π."""
    (ax, ay), (bx, by) = places[at] - places[before], places[after] - places[at]
    return float(abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by)))


def _thinned(chain: Chain, places: Mapping[int, Array], factor: float, thresholds: Thresholds) -> Chain:
    """The chain with fewer vertices, at equal distances along it."""
    path = chain.vertices
    turning = sum(_turn(places, *path[i - 1 : i + 2]) for i in range(1, len(path) - 1))
    least = 3 if path[0] == path[-1] else 1
    pieces = max(least, round((len(path) - 1) / factor), int(np.ceil(turning / thresholds.outline_turn)))
    kept = np.unique(np.rint(np.linspace(0, len(path) - 1, pieces + 1)).astype(int))
    return Chain([path[i] for i in kept], chain.side, chain.left, chain.right)
