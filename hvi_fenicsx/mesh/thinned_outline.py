"""The outline of a plane mesh with fewer vertices: its boundary, and what parts its regions.

It is cut into chains of edges at corners, where sides end and where regions meet. Of each chain every so many vertices
are kept, so that what is finer in the mesh stays finer in the outline.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..typing import Array, Integers, Mask

_CORNER = np.radians(20.0)
"""By which the outline turns at a vertex that is kept in any case."""
_TURN = np.radians(30.0)
"""Of a chain, at most, between two vertices that are kept: a coarse chord must not leave its curve far behind."""
_ALONG = 1e-9
"""Angle between two edges that run along each other."""
NONE = -1
"""Stands for no side, or no region."""


@dataclass(frozen=True)
class HalfEdges:
    """Edges of cells that may lie on the outline, each with its cell on the left.

    Attributes:
        ends: vertex numbers, (k, 2). points: their places, (k, 2, 2). region, side: numbers, or NONE, (k,).
    """

    ends: Integers
    points: Array
    region: Integers
    side: Integers

    @classmethod
    def joined(cls, parts: Sequence[HalfEdges]) -> HalfEdges:
        """Those of all ranks, without the pairs that only ranks part; numbered and ordered by place, whatever ranks."""
        ends, points = np.concatenate([p.ends for p in parts]), np.concatenate([p.points for p in parts])
        region, side = np.concatenate([p.region for p in parts]), np.concatenate([p.side for p in parts])
        labels = np.column_stack([np.sort(ends, axis=1), region, side])
        _, which, counts = np.unique(labels, axis=0, return_inverse=True, return_counts=True)
        kept = (counts[which.ravel()] == 1) | (side != NONE)
        ends = _by_place(ends[kept], points[kept])
        order = np.lexsort(ends.T)
        return cls(ends[order], points[kept][order], region[kept][order], side[kept][order])


def _by_place(ends: Integers, points: Array) -> Integers:
    """The same vertices, numbered from left to right; those at one place (of a crack) by their numbers."""
    numbers, first, which = np.unique(ends, return_index=True, return_inverse=True)
    x, y = points.reshape(-1, 2)[first].T
    new = np.empty(len(numbers), dtype=np.int64)
    new[np.lexsort((numbers, y, x))] = np.arange(len(numbers))
    return new[which].reshape(ends.shape)


@dataclass(frozen=True)
class Chain:
    """Edges between two joints. ``vertices``: all of them, in order; ``left``, ``right``: regions, None for no cell."""

    vertices: list[int]
    side: int
    left: int | None
    right: int | None


Loop = tuple[int, list[tuple[int, bool]]]
"""A region to the left of a closed path, and its chains with whether it runs along them forward."""


@dataclass(frozen=True)
class Face:
    """A piece of a region: (chain, whether it runs forward) of its boundary, then of each of its holes."""

    region: int
    loops: list[list[tuple[int, bool]]]


@dataclass(frozen=True)
class Outline:
    """Chains thinned out, and the faces between them; ``places`` by vertex number."""

    chains: list[Chain]
    faces: list[Face]
    places: Mapping[int, Array]


def traced(edges: HalfEdges, factor: float, different: float) -> Outline | None:
    """The outline with one vertex of so many kept; None where that cannot be meshed or is another body.

    So it is where it touches itself (gmsh takes crossing edges for an endless task) or has another area, and where
    a side ends inside of a body.

    Args:
        edges: of all ranks.
        factor: so many edges become one, about.
        different: part of the area by which the thinned one may differ.
    """
    places = dict(zip(edges.ends.ravel().tolist(), edges.points.reshape(-1, 2), strict=True))
    chains = _chains(edges, places)
    loops = _loops(chains)
    if loops is None:
        return None
    faces, thinned = _faces(chains, loops, places), [_thinned(c, places, factor) for c in chains]
    pairs = np.array([pair for c in thinned for pair in pairwise(c.vertices)])
    if faces is None or _touching(pairs, np.array([[places[a], places[b]] for a, b in pairs])):
        return None
    before, after = (sum(_area(p) for p in _polygons(c, loops, places)) for c in (chains, thinned))
    if abs(after / before - 1.0) >= different:
        return None
    return Outline(thinned, faces, places)


Label = tuple[int, int | None, int | None]
"""Side, region to the left, region to the right of an edge."""


def _chains(edges: HalfEdges, places: Mapping[int, Array]) -> list[Chain]:
    labels = _labels(edges)
    neighbours: dict[int, list[int]] = defaultdict(list)
    for a, b in labels:
        neighbours[a].append(b)

    def joint(v: int) -> bool:
        before, after = neighbours[v][0], neighbours[v][-1]
        if len(neighbours[v]) != 2 or labels[before, v] != labels[v, after]:
            return True
        return _turn(places, before, v, after) > _CORNER

    joints = {v for v in neighbours if joint(v)}
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
    """Of each edge, in both directions."""
    regions: dict[tuple[int, int], int] = {}
    sides: dict[tuple[int, int], int] = {}
    for a, b, region, side in np.column_stack([edges.ends, edges.region, edges.side]):
        regions[int(a), int(b)] = int(region)
        for way in ((int(a), int(b)), (int(b), int(a))):
            sides[way] = max(int(side), sides.get(way, NONE))
    return {(a, b): (side, regions.get((a, b)), regions.get((b, a))) for (a, b), side in sides.items()}


def _walk(start: int, second: int, neighbours: Mapping[int, list[int]], joints: set[int]) -> list[int]:
    path = [start, second]
    while path[-1] not in joints and path[-1] != start:
        path.append(next(v for v in neighbours[path[-1]] if v != path[-2]))
    return path


def _turn(places: Mapping[int, Array], before: int, at: int, after: int) -> float:
    """The angle by which the outline turns at a vertex, 0 to π."""
    (ax, ay), (bx, by) = places[at] - places[before], places[after] - places[at]
    return float(abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by)))


def _thinned(chain: Chain, places: Mapping[int, Array], factor: float) -> Chain:
    path = chain.vertices
    turning = sum(_turn(places, *path[i - 1 : i + 2]) for i in range(1, len(path) - 1))
    least = 3 if path[0] == path[-1] else 1
    pieces = max(least, round((len(path) - 1) / factor), int(np.ceil(turning / _TURN)))
    kept = np.unique(np.rint(np.linspace(0, len(path) - 1, pieces + 1)).astype(int))
    return Chain([path[i] for i in kept], chain.side, chain.left, chain.right)


def _loops(chains: Sequence[Chain]) -> list[Loop] | None:
    """Closed loops of chains by region, which lies on their left; None where one does not close."""
    leaving: dict[tuple[int, int], list[tuple[int, bool]]] = defaultdict(list)
    for number, chain in enumerate(chains):
        if chain.left == chain.right:
            return None
        for region, forward in ((chain.left, True), (chain.right, False)):
            if region is not None:
                leaving[region, chain.vertices[0 if forward else -1]].append((number, forward))
    if any(len(found) > 1 for found in leaving.values()):
        return None
    found = []
    while leaving:
        (region, at), _ = next(iter(leaving.items()))
        loop: list[tuple[int, bool]] = []
        while (region, at) in leaving:
            loop += leaving.pop((region, at))
            at = chains[loop[-1][0]].vertices[-1 if loop[-1][1] else 0]
        if at != chains[loop[0][0]].vertices[0 if loop[0][1] else -1]:
            return None
        found.append((region, loop))
    return found


def _faces(chains: Sequence[Chain], loops: Sequence[Loop], places: Mapping[int, Array]) -> list[Face] | None:
    """Loops that run counterclockwise, each with the clockwise ones of its region that lie inside of it."""
    polygons = _polygons(chains, loops, places)
    areas = [_area(p) for p in polygons]
    faces = {i: Face(loops[i][0], [loops[i][1]]) for i, area in enumerate(areas) if area > 0}
    for i in (i for i, area in enumerate(areas) if area <= 0):
        around = [j for j in faces if loops[j][0] == loops[i][0] and _holds(polygons[j], polygons[i][0])]
        if not around:
            return None
        faces[min(around, key=lambda j: areas[j])].loops.append(loops[i][1])
    return list(faces.values())


def _polygons(chains: Sequence[Chain], loops: Sequence[Loop], places: Mapping[int, Array]) -> list[Array]:
    """The corners of each loop, (n, 2)."""
    return [np.array([places[v] for v in _vertices(chains, loop)]) for _, loop in loops]


def _vertices(chains: Sequence[Chain], loop: Sequence[tuple[int, bool]]) -> Iterator[int]:
    for number, forward in loop:
        path = chains[number].vertices
        yield from (path if forward else path[::-1])[:-1]


def _area(polygon: Array) -> float:
    x, y = polygon.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def _holds(polygon: Array, point: Array) -> bool:
    """Whether a point, on no edge of it, lies within a polygon: an odd number of edges are to its right."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    crossing = (a[:, 1] > point[1]) != (b[:, 1] > point[1])
    a, b = a[crossing], b[crossing]
    x = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(x > point[0]) % 2)


def _touching(ends: Integers, segments: Array) -> bool:
    """Whether any two edges (n, 2, 2) meet elsewhere than in a vertex of both, or leave one in the same direction."""
    for i in range(len(ends) - 1):
        shared = np.isin(ends[i + 1 :], ends[i]).any(axis=1)
        if np.any(_meeting(segments[i], segments[i + 1 :]) & ~shared):
            return True
    away = np.concatenate([segments[:, 1] - segments[:, 0], segments[:, 0] - segments[:, 1]])
    angle, start = np.arctan2(away[:, 1] + 0.0, away[:, 0]), ends.T.ravel()  # no -0, whose angle would be -π
    order = np.lexsort((angle, start))
    return bool(np.any((np.diff(start[order]) == 0) & (np.diff(angle[order]) < _ALONG)))


def _meeting(one: Array, others: Array) -> Mask:
    """Which of the segments (n, 2, 2) one of them, (2, 2), meets, ends included."""
    (a, b), (c, d) = one, others.transpose(1, 0, 2)
    near = (np.maximum(a, b) >= np.minimum(c, d)) & (np.minimum(a, b) <= np.maximum(c, d))
    apart = (_left(a, b, c) * _left(a, b, d) > 0) | (_left(c, d, a) * _left(c, d, b) > 0)
    return np.asarray(near.all(axis=1) & ~apart)


def _left(a: Array, b: Array, point: Array) -> Array:
    """Twice the area of the triangle a, b, point, which is positive where the point is to the left."""
    (ux, uy), (vx, vy) = np.moveaxis(b - a, -1, 0), np.moveaxis(point - a, -1, 0)
    return np.asarray(ux * vy - uy * vx)
