"""A coarser mesh of a body, made by gmsh (:mod:`.gmsh_process`) within its surface, of which the plane one is thinned.

Its facets and cells take the side and the region of the nearest facet or cell of the fine mesh. It serves as a start
value and a preconditioner only: where two sides meet in the middle of a flat face, or two regions inside of the body,
their border is right to the width of a cell.
"""

from __future__ import annotations

import io
import math
import os
import subprocess
import tempfile
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import shapely
from dolfinx import mesh as dmesh

from .. import compat
from ..runtime import processes
from ..runtime.mpi import agree, on_root, total
from ..typing import Array, Entities, Integers, Mask
from . import facets as cell_facets
from . import gmsh_process, refinement
from .domain import DEFAULT, Domain


@dataclass(frozen=True)
class _CellSample:
    """Some of all ranks' cells.

    Attributes:
        midpoints: m, (k, d).
        sizes: edge of a regular simplex of the same volume, m, (k,).
        ranks: where each cell is, (k,).
        within: whether the cell is in each region, (k, regions).
    """

    midpoints: Array
    sizes: Array
    ranks: Integers
    within: Mask


@dataclass(frozen=True)
class _Surface:
    """All facets of the body's surface.

    Attributes:
        nodes: numbers of the nodes in the mesh file, (f, d).
        corners: m, (f, d, d).
        on: whether the facet is on each side, (f, sides).
    """

    nodes: Integers
    corners: Array
    on: Mask


def coarsen(domain: Domain, factor: float) -> Domain | None:
    """The body on a mesh of larger cells. Collective.

    Args:
        domain: the body.
        factor: by which edges get longer, about.

    Returns:
        None where gmsh fails, or where volume or areas differ too much.
    """
    comm, d = domain.mesh.comm, domain.dimension
    cells, surface = _sample(domain), _surface(domain)
    if surface is None:
        return None
    found = on_root(comm, lambda: (_in_plane if d == 2 else _in_space)(surface, cells, factor))
    if found is None:
        return None
    points, corners = found
    mine = corners[cells.ranks[_nearest(cells.midpoints, points[corners].mean(axis=1))] == comm.rank]
    mesh = compat.simplex_mesh(comm, mine, points[: len(points) * (comm.rank == 0)], domain.mesh.topology.cell_name())
    sides, regions = _sides(domain, mesh, surface), _regions(domain, mesh, cells)
    coarse = replace(domain, mesh=mesh, sides=sides, regions=regions, shared=None)
    before, after = measures(domain), measures(coarse)
    similar = all(abs(after[name] - size) <= DEFAULT.remeshed_size * size for name, size in before.items())
    return coarse if similar else None


def _sample(domain: Domain) -> _CellSample:
    """The same cells in the same order for any number of ranks. Collective."""
    comm, topology, d = domain.mesh.comm, domain.mesh.topology, domain.dimension
    every = max(1, topology.index_map(d).size_global // DEFAULT.hierarchy_from)
    numbers = topology.original_cell_index
    chosen = np.flatnonzero(numbers % every == 0)
    corners = owned_corners(domain.mesh)[chosen]
    within = np.zeros((len(numbers), len(domain.regions)), dtype=bool)
    for i, name in enumerate(sorted(domain.regions)):
        within[domain.regions[name], i] = True
    regular = math.sqrt(d + 1) / (math.factorial(d) * 2 ** (d / 2))  # volume of a simplex whose edges are 1
    sizes, ranks = (_volumes(corners) / regular) ** (1 / d), np.full(len(chosen), comm.rank)
    parts = agree(comm, (numbers[chosen], corners.mean(axis=1), sizes, ranks, within[chosen]))
    order, *found = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return _CellSample(*(array[np.argsort(order)] for array in found))


def _surface(domain: Domain) -> _Surface | None:
    """The body's surface; None where a side lies inside of the body. Collective."""
    mesh, d = domain.mesh, domain.dimension
    facets, owned = cell_facets.exterior(mesh), mesh.topology.index_map(d - 1)
    on: Mask = np.zeros((owned.size_local + owned.num_ghosts, len(domain.sides)), dtype=np.bool_)
    for i, name in enumerate(sorted(domain.sides)):
        on[domain.sides[name], i] = True
    inside = np.setdiff1d(np.flatnonzero(on[: owned.size_local].any(axis=1)), facets)
    nodes = _outward(mesh, facets)
    numbers = mesh.geometry.input_global_indices[nodes]
    parts = agree(mesh.comm, (len(inside), numbers, mesh.geometry.x[nodes][:, :, :d], on[facets]))
    if any(part[0] for part in parts):
        return None
    found = [np.concatenate([part[i] for part in parts]) for i in (1, 2, 3)]
    order = np.lexsort(np.sort(found[0], axis=1).T)
    return _Surface(*(array[order] for array in found))


def _outward(mesh: dmesh.Mesh, facets: Entities) -> Entities:
    """The (local) nodes of facets; of triangles counterclockwise as seen from outside, from the file's first on."""
    nodes = cell_facets.nodes_of(mesh, facets)
    if mesh.topology.dim == 2:
        return nodes
    links = mesh.topology.connectivity(2, 3)
    middle = mesh.geometry.x[compat.geometry_dofmap(mesh)[links.array[links.offsets[facets]]]].mean(axis=1)
    a, b, c = mesh.geometry.x[nodes].transpose(1, 0, 2)
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), middle - a) > 0
    nodes = np.where(inward[:, None], nodes[:, ::-1], nodes)
    first = np.argmin(mesh.geometry.input_global_indices[nodes], axis=1)
    return np.take_along_axis(nodes, (first[:, None] + np.arange(3)) % 3, axis=1)


def _in_plane(surface: _Surface, cells: _CellSample, factor: float) -> tuple[Array, Integers] | None:
    """Vertices (n, 2) and triangles (c, 3) within the thinned outline, each of whose edges is one of a triangle.

    None where the outline touches itself: gmsh would work on crossing edges for ever. On rank 0.
    """
    body = shapely.build_area(shapely.MultiLineString(list(surface.corners)))
    if body.geom_type != "Polygon":
        return None
    unit = float(np.ptp(surface.corners, axis=(0, 1)).max())
    rings = [shapely.get_coordinates(ring) / unit for ring in (body.exterior, *body.interiors)]
    thinned = [_thinned(ring, factor, DEFAULT.outline_turn) for ring in rings]
    if not shapely.Polygon(thinned[0], thinned[1:]).is_valid:
        return None
    try:
        points, corners = gmsh_process.within(thinned)
    except Exception:
        # gmsh raises bare Exceptions, whatever it is that it cannot mesh
        return None
    return points[:, :2] * unit, corners


def _thinned(ring: Array, factor: float, most: float) -> Array:
    """A ring (n, 2), its first vertex last again, with fewer vertices: at equal distances from corner to corner.

    Args:
        ring: of vertices.
        factor: about how many edges become one.
        most: by how much (radian) a corner turns at least, and one edge to the next, about, between corners.
    """
    (ax, ay), (bx, by) = np.roll(edges := np.diff(ring, axis=0), 1, axis=0).T, edges.T
    turns = np.abs(np.arctan2(ax * by - ay * bx, ax * bx + ay * by))
    first = int(np.argmax(turns))
    ring, turns = np.roll(ring[:-1], -first, axis=0), np.roll(turns, -first)
    corners = np.unique([0, *np.flatnonzero(turns > most), len(ring)])
    kept = []
    for start, end in pairwise(corners):
        pieces = max(round((end - start) / factor), math.ceil(turns[start + 1 : end].sum() / most), 1)
        kept.append(np.unique(np.rint(np.linspace(start, end, pieces + 1)[:-1]).astype(int)))
    found = ring[np.concatenate(kept)]
    return np.vstack([found, found[:1]])


def _in_space(surface: _Surface, cells: _CellSample, factor: float) -> tuple[Array, Integers] | None:
    """Vertices (n, 3) and cells (c, 4), or None where gmsh fails, or takes too long. On rank 0.

    It works in a process of its own: for a surface that it cannot parametrise it may take any time, or end its process.
    """
    _, first, inverse = np.unique(surface.nodes, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1, 3)
    if not _one_shell(triangles):
        return None
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder, "surface.npz")
        np.savez(
            source, points=surface.corners.reshape(-1, 3)[first], triangles=triangles, places=cells.midpoints,
            sizes=factor * cells.sizes, turn=2.0 * DEFAULT.outline_turn,
        )  # fmt: skip
        try:
            done = processes.run(gmsh_process.__name__, [os.fspath(source)], DEFAULT.gmsh_seconds)
        except subprocess.TimeoutExpired:
            return None
    if done.returncode or not done.stdout:
        return None
    with np.load(io.BytesIO(done.stdout)) as made:
        return made["points"], made["cells"]


def _one_shell(triangles: Integers) -> bool:
    """Whether each edge has two triangles, and all triangles are connected."""
    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    count = np.unique(edges, axis=0, return_counts=True)[1]
    return bool(np.all(count == 2)) and connected(edges, triangles.max() + 1)[0] == 1


def connected(pairs: Integers, size: int) -> tuple[int, Integers]:
    """How many pieces a graph has, and the piece of each of its nodes.

    Args:
        pairs: nodes that are connected, (k, 2).
        size: number of nodes.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs), np.int8), pairs.T), shape=(size, size))
    count, found = connected_components(graph, directed=False)
    return int(count), found


def _sides(domain: Domain, mesh: dmesh.Mesh, surface: _Surface) -> dict[str, Entities]:
    facets = cell_facets.exterior(mesh)
    middles = cell_facets.corners(mesh, facets).mean(axis=1)
    on = surface.on[_nearest(surface.corners.mean(axis=1), middles)]
    return {name: facets[on[:, i]] for i, name in enumerate(sorted(domain.sides))}


def _regions(domain: Domain, mesh: dmesh.Mesh, cells: _CellSample) -> dict[str, Entities]:
    within = cells.within[_nearest(cells.midpoints, owned_corners(mesh).mean(axis=1))]
    return {name: np.flatnonzero(within[:, i]).astype(np.int32) for i, name in enumerate(sorted(domain.regions))}


def measures(domain: Domain) -> dict[tuple[str, str], float]:
    """Volume of the body (m^d), areas of the sides and volumes of the regions, by kind and name. Collective."""
    volumes = _volumes(owned_corners(domain.mesh))
    sizes = {("body", ""): float(volumes.sum())}
    for name, facets in sorted(domain.sides.items()):
        sizes["side", name] = float(cell_facets.areas(cell_facets.corners(domain.mesh, facets)).sum())
    for name, cells in sorted(domain.regions.items()):
        sizes["region", name] = float(volumes[cells].sum())
    return {name: total(domain.mesh.comm, size) for name, size in sizes.items()}


def _nearest(places: Array, points: Array) -> Integers:
    """The number of the place that is nearest to each point."""
    from scipy.spatial import cKDTree

    return cKDTree(places).query(points)[1]


def owned_corners(mesh: dmesh.Mesh) -> Array:
    """Vertices of the cells that this rank owns, m, (c, d+1, d)."""
    return refinement.cell_corners(mesh)[: mesh.topology.index_map(mesh.topology.dim).size_local]


def _volumes(corners: Array) -> Array:
    """Volumes of cells, m^d."""
    edges = corners[:, 1:] - corners[:, :1]
    return np.abs(np.linalg.det(edges)) / math.factorial(edges.shape[1])
