"""A coarser mesh of a plane body, made by gmsh within its thinned outline: its boundary, and the lines between regions.

The outline is cut into chains of edges at corners, where sides end and where regions meet. In each chain only every
n-th vertex is kept, so that where the mesh is finer, the outline stays finer.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
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
from .thresholds import DEFAULT, MeshThresholds

NONE = -1
"""Stands for no side, or no region."""
_UNNAMED = ""

Point = tuple[float, float]
HalfEdges = tuple[Array, Integers, Integers]
"""Edges of cells that may lie on the outline: ends (k, 2, 2), the cell to the left; its region and the side, (k,)."""


@dataclass(frozen=True)
class Chain:
    """Edges between two joints.

    Attributes:
        points: all vertices, in order, (n, 2).
        side: number of the side, or NONE.
        left: region to the left.
        right: region to the right, None where there is no cell.
    """

    points: Array
    side: int
    left: int
    right: int | None

    def edges(self) -> Iterator[tuple[Point, Point]]:
        """The edges, in order."""
        yield from pairwise((float(x), float(y)) for x, y in self.points)

    def thinned(self, factor: float, most: float) -> Chain:
        """The chain with fewer vertices, at equal distances along it.

        Args:
            factor: about how many edges become one.
            most: by how much (radian) one edge may turn to the next, about.
        """
        edges, turning = len(self.points) - 1, float(_turns(self.points).sum())
        least = 3 if np.array_equal(self.points[0], self.points[-1]) else 1
        pieces = max(least, round(edges / factor), int(np.ceil(turning / most)))
        kept = np.unique(np.rint(np.linspace(0, edges, pieces + 1)).astype(int))
        return replace(self, points=self.points[kept])


@dataclass(frozen=True)
class Face:
    """A piece of a region.

    Attributes:
        region: number of the region, or NONE.
        rings: the vertices along its boundary, then along each of its holes, the first one last again.
        area: within.
    """

    region: int
    rings: list[list[Point]]
    area: float


def coarsen(domain: Domain, factor: float, thresholds: MeshThresholds = DEFAULT) -> Domain | None:
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
        names = on_root(comm, lambda: _mesh(gmsh, _outline(parts or [], factor, thresholds), sides, regions))
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
    return x[ends], region[cell], side[facets[cell, i]]


def _numbered(named: Mapping[str, Entities], names: Sequence[str], size: int) -> Integers:
    """For each entity the number of its name, or NONE."""
    numbers = np.full(size, NONE)
    for number, name in enumerate(names):
        numbers[named[name]] = number
    return numbers


def _outline(
    parts: Sequence[HalfEdges], factor: float, thresholds: MeshThresholds
) -> tuple[list[Chain], list[Face]] | None:
    """The outline with fewer vertices, and what it encloses.

    None where a side lies inside of a region, where the outline touches itself (gmsh would work on crossing edges for
    ever), or where the area differs too much.
    """
    chains = _chains(parts, thresholds.outline_turn)
    if chains is None or _meets_itself(chains):
        return None
    thinned = [chain.thinned(factor, thresholds.outline_turn) for chain in chains]
    if not shapely.MultiLineString([edge for chain in thinned for edge in chain.edges()]).is_simple:
        return None
    whole, faces = sum(face.area for face in _faces(chains)), _faces(thinned)
    if abs(sum(face.area for face in faces) - whole) >= thresholds.remeshed_size * whole:
        return None
    return thinned, faces


def _chains(parts: Sequence[HalfEdges], corner: float) -> list[Chain] | None:
    """The outline in chains of edges that are labelled alike, from corner to corner; None: a side within a region."""
    ends, region, side = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    rows = zip(ends.tolist(), region.tolist(), side.tolist(), strict=True)
    half = {((a[0], a[1]), (b[0], b[1])): (left, on) for (a, b), left, on in rows}
    labelled: dict[tuple[int, int, int | None], list[tuple[Point, Point]]] = defaultdict(list)
    for (a, b), (left, on) in sorted(half.items()):  # in an order that does not depend on the ranks
        right, other = half.get((b, a), (None, NONE))
        if right is None or left < right:
            labelled[max(on, other), left, right].append((a, b))
        elif left == right and max(on, other) != NONE:
            return None
    found = []
    for label, edges in labelled.items():
        merged = shapely.line_merge(shapely.MultiLineString(edges), directed=True)
        for points in map(shapely.get_coordinates, shapely.get_parts(merged)):
            cuts = [0, *(1 + np.flatnonzero(_turns(points) > corner)), len(points) - 1]
            found += [Chain(points[first : last + 1], *label) for first, last in pairwise(cuts)]
    return found


def _turns(points: Array) -> Array:
    """The angles (radian) by which a line turns at its inner vertices, 0 to π, (n - 2,)."""
    (ax, ay), (bx, by) = np.diff(points, axis=0)[:-1].T, np.diff(points, axis=0)[1:].T
    return np.abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))


def _meets_itself(chains: Sequence[Chain]) -> bool:
    """Whether the boundary of a region comes to a vertex twice."""
    starts = [(chain.left, *chain.points[0].tolist()) for chain in chains]
    starts += [(chain.right, *chain.points[-1].tolist()) for chain in chains if chain.right is not None]
    return max(Counter(starts).values()) > 1


def _faces(chains: Sequence[Chain]) -> list[Face]:
    """What the chains enclose, where there are cells."""
    regions: dict[tuple[Point, Point], int | None] = {}
    for chain in chains:
        for a, b in chain.edges():
            regions |= {(a, b): chain.left, (b, a): chain.right}
    found = []
    lines = shapely.polygonize([shapely.LineString(chain.points) for chain in chains])
    for polygon in map(shapely.geometry.polygon.orient, lines.geoms):
        rings = [list(ring.coords) for ring in (polygon.exterior, *polygon.interiors)]
        region = regions[rings[0][0], rings[0][1]]  # counterclockwise: the face lies to the left
        if region is not None:
            found.append(Face(region, rings, polygon.area))
    return found


def _mesh(
    gmsh: Any, outline: tuple[list[Chain], list[Face]] | None, sides: Sequence[str], regions: Sequence[str]
) -> dict[int, dict[str, int]] | None:
    """Mesh the outline in gmsh; its physical groups, or None where it cannot. On gmsh's rank."""
    if outline is None:
        return None
    groups = _draw(gmsh, *outline, [*sides], [*regions, _UNNAMED])
    try:
        gmsh.model.mesh.generate(2)
    except Exception:
        # gmsh raises bare Exceptions, whatever it is that it cannot mesh
        return None
    return groups


def _draw(
    gmsh: Any, chains: Sequence[Chain], faces: Sequence[Face], sides: list[str], regions: list[str]
) -> dict[int, dict[str, int]]:
    """Draw the outline in gmsh, each of its edges one edge of a cell; the physical groups by dimension and name.

    Cells of no region are in the region of the last name.
    """
    geo, points = gmsh.model.geo, dict[Point, int]()
    lines: dict[tuple[Point, Point], int] = {}
    by_side: dict[int, list[int]] = defaultdict(list)
    for chain in chains:
        for a, b in chain.edges():
            start, end = (points.get(p) or points.setdefault(p, geo.addPoint(*p, 0.0)) for p in (a, b))
            line = geo.addLine(start, end)
            lines |= {(a, b): line, (b, a): -line}
            by_side[chain.side].append(line)
    drawn = [line for found in by_side.values() for line in found]
    by_side.pop(NONE, None)
    surfaces: dict[int, list[int]] = defaultdict(list)
    for face in faces:
        loops = [geo.addCurveLoop([lines[edge] for edge in pairwise(ring)]) for ring in face.rings]
        surfaces[face.region].append(geo.addPlaneSurface(loops))
    geo.synchronize()
    for line in drawn:
        gmsh.model.mesh.setTransfiniteCurve(line, 2)
    add = gmsh.model.addPhysicalGroup
    return {
        1: {sides[number]: add(1, found) for number, found in by_side.items()},
        2: {regions[number]: add(2, found) for number, found in surfaces.items()},
    }
