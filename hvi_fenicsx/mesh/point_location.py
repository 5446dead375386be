"""Points located in a mesh: the cell that holds each point, and its barycentric weights in that cell."""

from __future__ import annotations

import dolfinx
import numpy as np
from dolfinx import fem, geometry
from mpi4py import MPI

from .. import compat
from ..runtime.mpi import agree
from ..typing import Array, Integers
from .thresholds import DEFAULT, Thresholds


def interpolation_weights(
    points: Array, space: fem.FunctionSpace, vertices: Array, thresholds: Thresholds = DEFAULT
) -> tuple[Integers, Array]:
    """The vertices of the cell that holds each point, and the point's weights of them. Collective.

    Each rank is sent the cells that may hold its points. A point outside of all cells is moved to the nearest one.

    Args:
        points: this rank's points, m, (m, 3).
        space: P1 on the mesh in which they are located.
        vertices: local vertices of that mesh, m, (n, 3).
        thresholds: which weight is rounding.

    Returns:
        Global numbers of vertices (blocks), and barycentric weights, (m, d+1) both.
    """
    comm, d = space.mesh.comm, space.mesh.geometry.dim
    corners, numbers = _gathered(comm, points, vertices, space)
    if not len(points):  # nor has it cells to look in
        return np.empty((0, d + 1), dtype=np.int64), np.empty((0, d + 1))
    distinct, local = np.unique(numbers, return_inverse=True)
    local = local.reshape(numbers.shape)
    x = np.empty((len(distinct), d))
    x[local] = corners
    kind = space.mesh.topology.cell_name()
    mesh = compat.simplex_mesh(MPI.COMM_SELF, local, x, kind)
    found = mesh.topology.original_cell_index[containing_cells(mesh, points, thresholds)]
    weights = clipped(barycentric_weights(corners[found], points[:, :d]))
    return numbers[found], clipped(np.where(weights < thresholds.barycentric_rounding, 0.0, weights))


def _gathered(comm: MPI.Comm, points: Array, vertices: Array, space: fem.FunctionSpace) -> tuple[Array, Integers]:
    """Corners (k, d+1, d) and their global numbers (k, d+1) of all cells near this rank's points. Collective."""
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


def containing_cells(mesh: dolfinx.mesh.Mesh, points: Array, thresholds: Thresholds = DEFAULT) -> Integers:
    """The cell that holds each point, or the one nearest to it.

    Among the cells whose boxes hold the point, it is the one whose smallest barycentric weight is largest: dolfinx's
    own collision test also takes cells that miss the point by a millionth of their size.

    Args:
        mesh: a mesh of this process alone.
        points: m, (m, 3).
        thresholds: which weight is rounding.
    """
    d = mesh.topology.dim
    tree = geometry.bb_tree(mesh, d, padding=1e-12 * float(np.ptp(mesh.geometry.x)))
    boxed = geometry.compute_collisions_points(tree, points)
    point = np.repeat(np.arange(len(points)), np.diff(boxed.offsets))
    corners = mesh.geometry.x[compat.geometry_dofmap(mesh)[boxed.array, : d + 1]][:, :, : mesh.geometry.dim]
    least = barycentric_weights(corners, points[point, : mesh.geometry.dim]).min(axis=1)
    found, best = np.full(len(points), -1, dtype=np.int64), np.full(len(points), -np.inf)
    order = np.argsort(least)  # of several entries for one point, the last one stays
    found[point[order]], best[point[order]] = boxed.array[order], least[order]
    outside = np.flatnonzero(best < -thresholds.barycentric_rounding)
    if len(outside):
        everything = np.arange(mesh.topology.index_map(d).size_local, dtype=np.int32)
        middles = geometry.create_midpoint_tree(mesh, d, everything)
        found[outside] = geometry.compute_closest_entity(tree, middles, mesh, points[outside])
    return found


def clipped(weights: Array) -> Array:
    """Barycentric weights (..., c) moved into the simplex: none is negative, and their sum is 1."""
    positive = np.clip(weights, 0.0, 1.0)
    return np.asarray(positive / positive.sum(axis=-1, keepdims=True))


def barycentric_weights(corners: Array, points: Array) -> Array:
    """Barycentric weights of points in simplices, (..., c).

    Args:
        corners: of the simplices, (..., c, d).
        points: (..., d); where c ≤ d, the weights are those of their projections onto the simplex's plane or line.
    """
    first = corners[..., 0, :]
    edges = corners[..., 1:, :] - first[..., None, :]
    gram = np.einsum("...id,...jd->...ij", edges, edges)
    right = np.einsum("...id,...d->...i", edges, points - first)
    rest = np.einsum("...ij,...j->...i", np.linalg.inv(gram), right)
    return np.concatenate([1.0 - rest.sum(axis=-1, keepdims=True), rest], axis=-1)
