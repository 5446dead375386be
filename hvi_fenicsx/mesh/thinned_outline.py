"""The outline of a plane mesh with fewer vertices: its boundary, and the lines between its regions.

It is cut into chains of edges at corners, where sides end and where regions meet. In each chain only every n-th vertex
is kept, so that where the mesh is finer, the outline stays finer.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..typing import Array, Integers
from . import polygons
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


Loop = tuple[int, list[tuple[int, bool]]]
"""A region to the left of a closed path, and the path's chains, each with whether it runs forward."""


@dataclass(frozen=True)
class Face:
    """A piece of a region.

    Attributes:
        region: number of the region, or NONE.
        loops: (chain, whether it runs forward) along its boundary, then along each of its holes.
    """

    region: int
    loops: list[list[tuple[int, bool]]]


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
    loops = _loops(chains)
    if loops is None:
        return None
    faces, thinned = _faces(chains, loops, places), [_thinned(c, places, factor, thresholds) for c in chains]
    if faces is None or _touches_itself(thinned, places, thresholds):
        return None
    before, after = (sum(polygons.area(p) for p in _polygons(c, loops, places)) for c in (chains, thinned))
    if abs(after / before - 1.0) >= thresholds.outline_area:
        return None
    return ThinnedOutline(thinned, faces, places)


def _touches_itself(chains: Sequence[Chain], places: Mapping[int, Array], thresholds: Thresholds) -> bool:
    pairs = np.array([pair for c in chains for pair in pairwise(c.vertices)])
    segments = np.array([[places[a], places[b]] for a, b in pairs])
    return polygons.edges_touch(pairs, segments, thresholds.outline_parallel)


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
        or _turn(places, around[0], v, around[1]) > thresholds.outline_corner
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
    corners = _polygons(chains, loops, places)
    areas = [polygons.area(p) for p in corners]
    faces = {i: Face(loops[i][0], [loops[i][1]]) for i, area in enumerate(areas) if area > 0}
    for i in (i for i, area in enumerate(areas) if area <= 0):
        around = [j for j in faces if loops[j][0] == loops[i][0] and polygons.holds(corners[j], corners[i][0])]
        if not around:
            return None
        faces[min(around, key=lambda j: areas[j])].loops.append(loops[i][1])
    return list(faces.values())


def _polygons(chains: Sequence[Chain], loops: Sequence[Loop], places: Mapping[int, Array]) -> list[Array]:
    """The corners of each loop, (n, 2)."""
    return [np.array([places[v] for v in _vertices(chains, loop)]) for _, loop in loops]


def _vertices(chains: Sequence[Chain], loop: Sequence[tuple[int, bool]]) -> Iterator[int]:
    """The vertices along a loop, each once."""
    for number, forward in loop:
        path = chains[number].vertices
        yield from (path if forward else path[::-1])[:-1]
