"""A coarser mesh of a plane body, made by gmsh within its thinned outline: its boundary, and the lines between regions.

The outline is cut into chains of edges at corners, where sides end and where regions meet. In each chain only every
n-th vertex is kept, so that where the mesh is finer, the outline stays finer.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from .. import compat
from ..runtime.mpi import on_root
from ..typing import Array, Entities, Integers
from . import gmsh_arrays, gmsh_file
from .domain import Domain
from .facets import cell_facets
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


_UNNAMED = ""


def coarsen(domain: Domain, factor: float, thresholds: Thresholds = DEFAULT) -> Domain | None:
    """The plane body on a mesh of longer edges. Collective.

    Args:
        domain: the body.
        factor: by which edges get longer, about.
        thresholds: which vertices of the outline are kept, and how far the areas may differ.

    Returns:
        None where gmsh cannot mesh the thinned outline, or where its area differs too much.
    """
    comm, sides, regions = domain.mesh.comm, sorted(domain.sides), sorted(domain.regions)
    parts = comm.gather(_half_edges(domain, sides, regions))
    with gmsh_file.session(comm) as gmsh:
        names = on_root(comm, lambda: _mesh(gmsh, _outline(parts, factor, thresholds), sides, regions))
        if names is None:
            return None
        mesh, found, within = gmsh_file.distribute(comm, gmsh and gmsh_arrays.extract(gmsh, 2), 2, names)
    mesh.geometry.x[:] *= domain.length
    return replace(domain, mesh=mesh, sides=found, regions={name: within[name] for name in regions}, shared=None)


def _half_edges(domain: Domain, sides: Sequence[str], regions: Sequence[str]) -> HalfEdges:
    """This rank's edges without a second cell, on a side, or between regions; lengths relative to the body's."""
    mesh = domain.mesh
    facets, nodes = cell_facets(mesh), compat.geometry_dofmap(mesh)
    region = _numbered(domain.regions, regions, len(facets))
    side = _numbered(domain.sides, sides, facets.max(initial=-1) + 1)
    cells = np.repeat(np.arange(len(facets)), 3)
    own = facets.ravel()
    alone = np.bincount(own, minlength=len(side)) == 1
    least, most = np.full(len(side), len(regions)), np.full(len(side), NONE)
    np.minimum.at(least, own, region[cells])
    np.maximum.at(most, own, region[cells])
    cell, i = np.divmod(np.flatnonzero((alone | (side != NONE) | (least != most))[own]), 3)
    ends = np.stack([nodes[cell, (i + 1) % 3], nodes[cell, (i + 2) % 3]], axis=1)
    x = mesh.geometry.x[:, :2] / domain.length
    (ax, ay), (bx, by) = (x[ends[:, 1]] - x[ends[:, 0]]).T, (x[nodes[cell, i]] - x[ends[:, 0]]).T
    ends = np.where((ax * by < ay * bx)[:, None], ends[:, ::-1], ends)  # the cell to the left
    numbers = mesh.geometry.index_map().local_to_global(ends.ravel().astype(np.int32)).reshape(-1, 2)
    return HalfEdges(numbers, x[ends], region[cell], side[facets[cell, i]])


def _numbered(named: Mapping[str, Entities], names: Sequence[str], size: int) -> Integers:
    """For each entity the number of its name, or NONE."""
    numbers = np.full(size, NONE)
    for number, name in enumerate(names):
        numbers[named[name]] = number
    return numbers


def _outline(parts: Sequence[HalfEdges] | None, factor: float, thresholds: Thresholds) -> ThinnedOutline | None:
    return trace(HalfEdges.joined(parts or []), factor, thresholds)


def _mesh(
    gmsh: Any, thinned: ThinnedOutline | None, sides: Sequence[str], regions: Sequence[str]
) -> dict[int, dict[str, int]] | None:
    """Mesh the thinned outline in gmsh; its physical groups, or None where it cannot. On gmsh's rank."""
    if thinned is None:
        return None
    groups = _draw(gmsh, thinned, [*sides], [*regions, _UNNAMED])
    try:
        gmsh.model.mesh.generate(2)
    except Exception:
        # gmsh raises bare Exceptions, whatever it is that it cannot mesh
        return None
    return groups


def _draw(gmsh: Any, thinned: ThinnedOutline, sides: list[str], regions: list[str]) -> dict[int, dict[str, int]]:
    """Draw the outline in gmsh, each of its edges one edge of a cell; the physical groups by dimension and name.

    Cells of no region are in the region of the last name.
    """
    geo = gmsh.model.geo
    kept = sorted({v for chain in thinned.chains for v in chain.vertices})
    points = {v: geo.addPoint(*thinned.places[v], 0.0) for v in kept}
    edges = [(a, b, chain.side) for chain in thinned.chains for a, b in pairwise(chain.vertices)]
    lines: dict[tuple[int, int], int] = {}
    by_side: dict[int, list[int]] = {}
    for a, b, side in edges:
        line = geo.addLine(points[a], points[b])
        lines |= {(a, b): line, (b, a): -line}
        by_side.setdefault(side, []).append(line)
    by_side.pop(NONE, None)
    surfaces: dict[int, list[int]] = {}
    for face in thinned.faces:
        loops = [geo.addCurveLoop([lines[pair] for pair in pairwise([*ring, ring[0]])]) for ring in face.rings]
        surfaces.setdefault(face.region, []).append(geo.addPlaneSurface(loops))
    geo.synchronize()
    for a, b, _ in edges:
        gmsh.model.mesh.setTransfiniteCurve(lines[a, b], 2)
    add = gmsh.model.addPhysicalGroup
    return {
        1: {sides[number]: add(1, found) for number, found in by_side.items()},
        2: {regions[number]: add(2, found) for number, found in surfaces.items()},
    }


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
