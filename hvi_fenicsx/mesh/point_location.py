"""Points placed in a mesh that they do not belong to: the cell that holds each, and barycentric weights in it."""

from __future__ import annotations

import dolfinx
import numpy as np
from dolfinx import fem, geometry
from mpi4py import MPI

from .. import compat
from ..runtime.mpi import agree
from ..typing import Array, Integers

_NOTHING = 1e-9
"""A barycentric weight that is rounding: the point lies on the facet opposite to that vertex."""


def between(points: Array, space: fem.FunctionSpace, vertices: Array) -> tuple[Integers, Array]:
    """The vertices (global blocks) between which each point (m, 3) lies, and their weights; (m, d+1) both. Collective.

    Each rank is sent the cells that may hold its points. A point outside of all cells is moved to the nearest one.

    Args:
        points: this rank's. space: P1, of the mesh in which they are placed. vertices: its local ones, (n, 3).
    """
    comm, d = space.mesh.comm, space.mesh.geometry.dim
    corners, numbers = _gathered(comm, points, vertices, space)
    distinct, local = np.unique(numbers, return_inverse=True)
    local = local.reshape(numbers.shape)
    x = np.empty((len(distinct), d))
    x[local] = corners
    kind = space.mesh.topology.cell_name()
    mesh = compat.simplex_mesh(MPI.COMM_SELF, local, x, kind)
    found = mesh.topology.original_cell_index[cells(mesh, points)]
    share = inside(weights(corners[found], points[:, :d]))
    return numbers[found], inside(np.where(share < _NOTHING, 0.0, share))


def _gathered(comm: MPI.Comm, points: Array, vertices: Array, space: fem.FunctionSpace) -> tuple[Array, Integers]:
    """Corners (k, d+1, d) and their global numbers (k, d+1) of the cells near a rank's points, from all. Collective."""
    d = space.mesh.geometry.dim
    blocks = space.dofmap.list
    corners = vertices[blocks][:, :, :d]
    numbers = space.dofmap.index_map.local_to_global(blocks.ravel()).reshape(blocks.shape)
    low, high = corners.min(axis=1), corners.max(axis=1)
    widest = max(agree(comm, float(np.max(high - low, initial=0.0))))
    boxes = agree(comm, (points[:, :d].min(axis=0, initial=np.inf), points[:, :d].max(axis=0, initial=-np.inf)))
    wanted = [np.all((high >= a - widest) & (low <= b + widest), axis=1) for a, b in boxes]
    found = comm.alltoall([(corners[w], numbers[w]) for w in wanted])
    return np.concatenate([c for c, _ in found]), np.concatenate([n for _, n in found])


def cells(mesh: dolfinx.mesh.Mesh, points: Array) -> Integers:
    """The cell that holds each point (m, 3), or the one nearest to it, on a mesh of this process alone.

    Of those whose boxes hold it, it is the one with the largest least weight: dolfinx's own test of collision takes
    cells that are a millionth off.
    """
    d = mesh.topology.dim
    tree = geometry.bb_tree(mesh, d, padding=1e-12 * float(np.ptp(mesh.geometry.x)))
    boxed = geometry.compute_collisions_points(tree, points)
    point = np.repeat(np.arange(len(points)), np.diff(boxed.offsets))
    corners = mesh.geometry.x[compat.geometry_dofmap(mesh)[boxed.array]][:, :, : mesh.geometry.dim]
    least = weights(corners, points[point, : mesh.geometry.dim]).min(axis=1)
    found, best = np.full(len(points), -1, dtype=np.int64), np.full(len(points), -np.inf)
    order = np.argsort(least)  # of several entries for one point, the last one stays
    found[point[order]], best[point[order]] = boxed.array[order], least[order]
    outside = np.flatnonzero(best < -_NOTHING)
    if len(outside):
        everything = np.arange(mesh.topology.index_map(d).size_local, dtype=np.int32)
        middles = geometry.create_midpoint_tree(mesh, d, everything)
        found[outside] = geometry.compute_closest_entity(tree, middles, mesh, points[outside])
    return found


def inside(weights: Array) -> Array:
    """Barycentric weights of a point of the simplex near that of the given ones."""
    clipped = np.clip(weights, 0.0, 1.0)
    return np.asarray(clipped / clipped.sum(axis=-1, keepdims=True))


def weights(corners: Array, points: Array) -> Array:
    """Barycentric weights (..., c) of points (..., d) in simplices (..., c, d); of their projections where c ≤ d."""
    first = corners[..., 0, :]
    edges = corners[..., 1:, :] - first[..., None, :]
    gram = np.einsum("...id,...jd->...ij", edges, edges)
    right = np.einsum("...id,...d->...i", edges, points - first)
    rest = np.einsum("...ij,...j->...i", np.linalg.inv(gram), right)
    return np.concatenate([1.0 - rest.sum(axis=-1, keepdims=True), rest], axis=-1)
