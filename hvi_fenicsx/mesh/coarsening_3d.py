"""A coarser mesh of a body in space, made by gmsh (:mod:`.gmsh_worker`).

Its facets and cells take the side and the region of the nearest facet or cell of the fine mesh. It serves as a start
value and a preconditioner only: where two sides meet in the middle of a flat face, or two regions inside of the body,
their border is right to the width of a cell.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from dolfinx import mesh as dmesh

from .. import compat
from ..runtime import processes
from ..runtime.mpi import agree, on_root, total
from ..typing import Array, Entities, Integers, Mask
from . import refinement
from .domain import Domain
from .thresholds import DEFAULT, MeshThresholds


@dataclass(frozen=True)
class _CellSample:
    """Some of all ranks' cells.

    Attributes:
        midpoints: m, (k, 3).
        sizes: edge of a regular tetrahedron of the same volume, m, (k,).
        ranks: where each cell is, (k,).
        within: whether the cell is in each region, (k, regions).
    """

    midpoints: Array
    sizes: Array
    ranks: Integers
    within: Mask


@dataclass(frozen=True)
class _Surface:
    """All triangles of the body's surface.

    Attributes:
        nodes: numbers of the nodes in the mesh file, (t, 3).
        corners: m, (t, 3, 3).
        on: whether the triangle is on each side, (t, sides).
    """

    nodes: Integers
    corners: Array
    on: Mask


def coarsen(domain: Domain, factor: float, thresholds: MeshThresholds = DEFAULT) -> Domain | None:
    """The body on a mesh of larger cells. Collective.

    Args:
        domain: the body.
        factor: by which edges get longer, about.
        thresholds: how long gmsh may take, and how far volume and areas may differ.

    Returns:
        None where gmsh fails, or where volume or areas differ too much.
    """
    comm = domain.mesh.comm
    cells, surface = _sample(domain, thresholds), _surface(domain)
    remeshed = on_root(comm, lambda: _remeshed(surface, cells, factor, thresholds)) if surface else None
    if surface is None or remeshed is None:
        return None
    points, corners = remeshed
    mine = corners[cells.ranks[_nearest(cells.midpoints, points[corners].mean(axis=1))] == comm.rank]
    mesh = compat.simplex_mesh(comm, mine, points if comm.rank == 0 else points[:0], "tetrahedron")
    sides, regions = _sides(domain, mesh, surface), _regions(domain, mesh, cells)
    found = replace(domain, mesh=mesh, sides=sides, regions=regions, shared=None)
    return found if _similar(domain, found, thresholds.remeshed_size) else None


def _sample(domain: Domain, thresholds: MeshThresholds) -> _CellSample:
    """The same cells in the same order for any number of ranks. Collective."""
    comm, topology = domain.mesh.comm, domain.mesh.topology
    every = max(1, topology.index_map(3).size_global // thresholds.sampled_cells)
    numbers = np.asarray(topology.original_cell_index, dtype=np.int64)
    chosen = np.flatnonzero(numbers % every == 0)
    corners = owned_corners(domain.mesh)[chosen]
    within = np.zeros((len(numbers), len(domain.regions)), dtype=bool)
    for i, name in enumerate(sorted(domain.regions)):
        within[domain.regions[name], i] = True
    sizes, ranks = np.cbrt(6 * np.sqrt(2) * _volumes(corners)), np.full(len(chosen), comm.rank)
    parts = agree(comm, (numbers[chosen], corners.mean(axis=1), sizes, ranks, within[chosen]))
    order, *found = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return _CellSample(*(array[np.argsort(order)] for array in found))


def _surface(domain: Domain) -> _Surface | None:
    """The body's surface; None where a side lies inside of the body. Collective."""
    mesh, owned = domain.mesh, domain.mesh.topology.index_map(2).size_local
    facets = _exterior(mesh)
    on: Mask = np.zeros((owned + mesh.topology.index_map(2).num_ghosts, len(domain.sides)), dtype=np.bool_)
    for i, name in enumerate(sorted(domain.sides)):
        on[domain.sides[name], i] = True
    inside = np.setdiff1d(np.flatnonzero(on[:owned].any(axis=1)), facets)
    nodes = _outward(mesh, facets)
    numbers = np.asarray(mesh.geometry.input_global_indices, dtype=np.int64)[nodes]
    parts = agree(mesh.comm, (len(inside), numbers, mesh.geometry.x[nodes], on[facets]))
    if any(part[0] for part in parts):
        return None
    found = [np.concatenate([part[i] for part in parts]) for i in (1, 2, 3)]
    order = np.lexsort(np.sort(found[0], axis=1).T)
    return _Surface(*(array[order] for array in found))


def _exterior(mesh: dmesh.Mesh) -> Entities:
    mesh.topology.create_connectivity(2, 3)
    return np.asarray(dmesh.exterior_facet_indices(mesh.topology), dtype=np.int32)


def _outward(mesh: dmesh.Mesh, facets: Entities) -> Entities:
    """The (local) nodes of facets, counterclockwise as seen from outside, from the file's first on, (f, 3)."""
    if not len(facets):
        return np.empty((0, 3), dtype=np.int32)  # dolfinx divides by their number
    nodes = np.asarray(dmesh.entities_to_geometry(mesh, 2, facets), dtype=np.int32)
    links = mesh.topology.connectivity(2, 3)
    middle = mesh.geometry.x[compat.geometry_dofmap(mesh)[links.array[links.offsets[facets]]]].mean(axis=1)
    a, b, c = mesh.geometry.x[nodes].transpose(1, 0, 2)
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), middle - a) > 0
    nodes = np.where(inward[:, None], nodes[:, ::-1], nodes)
    first = np.argmin(np.asarray(mesh.geometry.input_global_indices)[nodes], axis=1)
    return np.take_along_axis(nodes, (first[:, None] + np.arange(3)) % 3, axis=1)


def _remeshed(
    surface: _Surface, cells: _CellSample, factor: float, thresholds: MeshThresholds
) -> tuple[Array, Integers] | None:
    """Vertices (n, 3) and cells (c, 4), or None where gmsh fails, or takes too long. On rank 0."""
    _, first, inverse = np.unique(surface.nodes, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1, 3)
    if not _one_shell(triangles):
        return None
    try:
        points = surface.corners.reshape(-1, 3)[first]
        return _run_gmsh(points, triangles, cells.midpoints, factor * cells.sizes, thresholds.gmsh_seconds)
    except (subprocess.SubprocessError, OSError):
        return None


def _run_gmsh(
    points: Array, triangles: Integers, places: Array, sizes: Array, timeout: float
) -> tuple[Array, Integers]:
    """The mesh that :mod:`.gmsh_worker` makes, in a process of its own, within a time limit (s).

    Raises:
        SubprocessError: it failed, or took too long.
        OSError: there is no room for the files that it reads and writes.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "given.npz"), Path(folder, "made.npz")
        np.savez(source, points=points, triangles=triangles, places=places, sizes=sizes)
        command = [*processes.PYTHON, "-m", "hvi_fenicsx.mesh.gmsh_worker", os.fspath(source), os.fspath(target)]
        subprocess.run(
            command, env=processes.environment(), cwd=folder, capture_output=True, check=True, timeout=timeout
        )
        with np.load(target) as made:
            return made["points"], made["cells"]


def _one_shell(triangles: Integers) -> bool:
    """Whether each edge has two triangles, and all triangles are connected."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    count = np.unique(edges, axis=0, return_counts=True)[1]
    graph = coo_array((np.ones(len(edges), np.int8), edges.T), shape=(triangles.max() + 1,) * 2)
    return bool(np.all(count == 2)) and connected_components(graph, directed=False)[0] == 1


def _sides(domain: Domain, mesh: dmesh.Mesh, surface: _Surface) -> dict[str, Entities]:
    facets = _exterior(mesh)
    middles = dmesh.compute_midpoints(mesh, 2, facets) if len(facets) else np.empty((0, 3))
    on = surface.on[_nearest(surface.corners.mean(axis=1), middles)]
    return {name: facets[on[:, i]] for i, name in enumerate(sorted(domain.sides))}


def _regions(domain: Domain, mesh: dmesh.Mesh, cells: _CellSample) -> dict[str, Entities]:
    within = cells.within[_nearest(cells.midpoints, owned_corners(mesh).mean(axis=1))]
    return {name: np.flatnonzero(within[:, i]).astype(np.int32) for i, name in enumerate(sorted(domain.regions))}


def _similar(fine: Domain, coarse: Domain, difference: float) -> bool:
    """Whether volume and areas differ by no more than this part, and no region is lost. Collective."""
    (before, after) = (measures(domain) for domain in (fine, coarse))
    return all(abs(after[name] - size) <= difference * size for name, size in before.items())


def measures(domain: Domain) -> dict[tuple[str, str], float]:
    """Volume of the body (m³), areas of the sides (m²) and volumes of the regions, by kind and name. Collective."""
    comm, x = domain.mesh.comm, domain.mesh.geometry.x
    volumes = _volumes(owned_corners(domain.mesh))
    sizes = {("body", ""): float(volumes.sum())}
    for name, facets in sorted(domain.sides.items()):
        corners = x[_outward(domain.mesh, facets)]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sizes["side", name] = float(np.linalg.norm(cross, axis=1).sum() / 2)
    for name, cells in sorted(domain.regions.items()):
        sizes["region", name] = float(volumes[cells].sum())
    return {name: total(comm, size) for name, size in sizes.items()}


def _nearest(places: Array, points: Array) -> Integers:
    """The number of the place that is nearest to each point."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(places).query(points)[1], dtype=np.int64)


def owned_corners(mesh: dmesh.Mesh) -> Array:
    """Vertices of the tetrahedra that this rank owns, m, (c, 4, 3)."""
    return refinement.cell_corners(mesh)[: mesh.topology.index_map(3).size_local]


def _volumes(corners: Array) -> Array:
    """Volumes of tetrahedra, m³."""
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6)
