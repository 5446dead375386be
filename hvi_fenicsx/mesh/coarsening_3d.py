"""A coarser mesh of a body in space, by gmsh (:mod:`.gmsh_worker`); sides and regions are those of the nearest cells.

It serves as a start and a preconditioner only: where sides part in the middle of a flat face, or regions inside of the
body, its own part there to the width of a cell.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from dolfinx import mesh as dmesh

from .. import compat
from ..runtime import processes
from ..runtime.mpi import agree, on_root, total
from ..typing import Array, Entities, Integers, Mask
from .domain import Domain
from .thresholds import DEFAULT, Thresholds

_SAMPLE = 20_000
"""Cells, about, by which sizes, regions and ranks are known."""


@dataclass(frozen=True)
class _Cells:
    """A sample of all ranks' cells: midpoints (k, 3), sizes (k,), ranks (k,), whether in each region (k, r)."""

    midpoints: Array
    sizes: Array
    ranks: Integers
    within: Mask


@dataclass(frozen=True)
class _Surface:
    """All triangles (t) of the surface: the file's nodes (t, 3), corners (t, 3, 3), whether on each side (t, s)."""

    nodes: Integers
    corners: Array
    on: Mask


def coarse(domain: Domain, factor: float, thresholds: Thresholds = DEFAULT) -> Domain | None:
    """The body with larger cells; None where gmsh fails, or makes another body. Collective.

    Args:
        domain: the body.
        factor: by which edges get longer, about.
        thresholds: how long gmsh may take, and how far the sizes may differ.
    """
    comm = domain.mesh.comm
    cells, surface = _sampled(domain), _surface(domain)
    made = on_root(comm, lambda: _remeshed(surface, cells, factor, thresholds)) if surface else None
    if surface is None or made is None:
        return None
    points, corners = made
    mine = corners[cells.ranks[_nearest(cells.midpoints, points[corners].mean(axis=1))] == comm.rank]
    if min(agree(comm, len(mine))) == 0:
        return None
    mesh = compat.simplex_mesh(comm, mine, points if comm.rank == 0 else points[:0], "tetrahedron")
    found = replace(domain, mesh=mesh, sides=_sides(domain, mesh, surface), regions=_regions(domain, mesh, cells))
    return found if _alike(domain, found, thresholds.remeshed_size) else None


def _sampled(domain: Domain) -> _Cells:
    """The same cells in the same order, whatever the ranks. Collective."""
    comm, topology = domain.mesh.comm, domain.mesh.topology
    every = max(1, topology.index_map(3).size_global // _SAMPLE)
    numbers = np.asarray(topology.original_cell_index, dtype=np.int64)
    chosen = np.flatnonzero(numbers % every == 0)
    corners = _corners(domain.mesh)[chosen]
    within = np.zeros((len(numbers), len(domain.regions)), dtype=bool)
    for i, name in enumerate(sorted(domain.regions)):
        within[domain.regions[name], i] = True
    sizes, ranks = np.cbrt(6 * np.sqrt(2) * _volumes(corners)), np.full(len(chosen), comm.rank)
    parts = agree(comm, (numbers[chosen], corners.mean(axis=1), sizes, ranks, within[chosen]))
    order, *found = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return _Cells(*(array[np.argsort(order)] for array in found))


def _surface(domain: Domain) -> _Surface | None:
    """None where a side lies inside of the body. Collective."""
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


def _remeshed(surface: _Surface, cells: _Cells, factor: float, thresholds: Thresholds) -> tuple[Array, Integers] | None:
    """Vertices (n, 3) and cells (c, 4), or None where gmsh fails, or takes too long. On rank 0."""
    _, first, inverse = np.unique(surface.nodes, return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1, 3)
    if not _one_shell(triangles):
        return None
    try:
        points, patience = surface.corners.reshape(-1, 3)[first], _patience(thresholds, len(triangles))
        return _by_child(points, triangles, cells.midpoints, factor * cells.sizes, patience)
    except (subprocess.SubprocessError, OSError):
        return None


def _patience(thresholds: Thresholds, triangles: int) -> float:
    """Seconds for gmsh."""
    return thresholds.gmsh_seconds + thresholds.gmsh_seconds_per_triangle * triangles


def _by_child(
    points: Array, triangles: Integers, places: Array, sizes: Array, patience: float
) -> tuple[Array, Integers]:
    """What :mod:`.gmsh_worker` makes of these arrays within so many seconds.

    Raises:
        SubprocessError: it failed, or took too long.
        OSError: there is no room for the files that it reads and writes.
    """
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "given.npz"), Path(folder, "made.npz")
        np.savez(source, points=points, triangles=triangles, places=places, sizes=sizes)
        command = [sys.executable, "-m", "hvi_fenicsx.mesh.gmsh_worker", os.fspath(source), os.fspath(target)]
        subprocess.run(command, env=processes.environment(), capture_output=True, check=True, timeout=patience)
        with np.load(target) as made:
            return made["points"], made["cells"]


def _one_shell(triangles: Integers) -> bool:
    """Whether each edge has two triangles, and all hang together."""
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


def _regions(domain: Domain, mesh: dmesh.Mesh, cells: _Cells) -> dict[str, Entities]:
    within = cells.within[_nearest(cells.midpoints, _corners(mesh).mean(axis=1))]
    return {name: np.flatnonzero(within[:, i]).astype(np.int32) for i, name in enumerate(sorted(domain.regions))}


def _alike(fine: Domain, found: Domain, different: float) -> bool:
    """Whether volume and sides are about the same, and no region is lost. Collective."""
    (before, after) = (_measures(domain) for domain in (fine, found))
    return all(abs(after[name] - size) <= different * size for name, size in before.items())


def _measures(domain: Domain) -> dict[tuple[str, str], float]:
    """Volume, areas of the sides, volumes of the regions. Collective."""
    comm, x = domain.mesh.comm, domain.mesh.geometry.x
    volumes = _volumes(_corners(domain.mesh))
    sizes = {("body", ""): float(volumes.sum())}
    for name, facets in sorted(domain.sides.items()):
        corners = x[_outward(domain.mesh, facets)]
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        sizes["side", name] = float(np.linalg.norm(cross, axis=1).sum() / 2)
    for name, cells in sorted(domain.regions.items()):
        sizes["region", name] = float(volumes[cells].sum())
    return {name: total(comm, size) for name, size in sizes.items()}


def _nearest(places: Array, points: Array) -> Integers:
    """The place (number) nearest to each point."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(places).query(points)[1], dtype=np.int64)


def _corners(mesh: dmesh.Mesh) -> Array:
    """Of the cells that this rank owns, (c, 4, 3)."""
    owned = mesh.topology.index_map(3).size_local
    return np.asarray(mesh.geometry.x[compat.geometry_dofmap(mesh)[:owned]])


def _volumes(corners: Array) -> Array:
    return np.asarray(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6)
