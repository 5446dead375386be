"""The transfer from a level of a mesh hierarchy to the next finer one: prolongation.

Between a mesh and its refinement each vertex of the finer one is a vertex of the coarser one or the midpoint of an
edge. Onto a mesh that is not nested the prolongation is linear interpolation. Blocks have transfers of their own
(:mod:`.blocks`).
"""

from __future__ import annotations

from dataclasses import dataclass

import dolfinx
import numpy as np
import numpy.typing as npt
from dolfinx import fem, geometry
from mpi4py import MPI
from petsc4py import PETSc
from scipy import sparse

from .. import compat
from ..geometry import ROUNDING
from ..runtime.mpi import agree, largest
from ..typing import Array, Entities, Integers
from . import nodes

Numbers = npt.NDArray[np.integer]
Halves = npt.NDArray[np.int8]
Rows = tuple[Numbers, Numbers, Array]
"""Compressed rows of a sparse matrix: where each begins, columns, values."""


class Transfer:
    """The way from a coarser mesh to a finer one of the same body, and so of P1 fields on it.

    It interpolates, whatever the meshes are; a subclass knows how they are nested.
    """

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> Rows:
        """The rows of this rank's fine unknowns, columns being the coarse unknowns' global numbers. Collective.

        Args:
            fine: P1 vectors on the finer mesh.
            coarse: P1 vectors on the coarser mesh.
        """
        owned = nodes.points(fine)[: fine.dofmap.index_map.size_local]
        corners, weights = interpolation_weights(owned, coarse)
        return weighted_rows(corners, weights, fine.dofmap.index_map_bs)

    def prolongation(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> PETSc.Mat:
        """The prolongation of P1 vector fields in Cartesian components. Collective.

        Args:
            fine: P1 vectors on the finer mesh.
            coarse: P1 vectors on the coarser mesh.

        Returns:
            Rows are the fine unknowns, columns the coarse ones.
        """
        rows = self.rows(fine, coarse)
        matrix = PETSc.Mat().createAIJ((_sizes(fine), _sizes(coarse)), csr=rows, comm=fine.mesh.comm)
        matrix.assemble()
        return matrix


@dataclass(frozen=True)
class ParentCellTransfer(Transfer):
    """From a mesh to its refinement.

    Attributes:
        parents: local parent cell of each local fine cell, (cells,).
        halves: twice the barycentric coordinates of each cell's vertices in the parent cell, (cells, d+1, d+1):
            a 2 for a vertex of the parent, two 1s for the middle of one of its edges.
    """

    parents: Entities
    halves: Halves

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> Rows:
        """The functions of the parent cells, in the bases of the two spaces. Local."""
        owned, d = fine.dofmap.index_map.size_local, fine.dofmap.index_map_bs
        if not owned:  # this rank may have no cell either
            return weighted_rows(np.empty((0, 1), dtype=np.int64), np.empty((0, 1)), d)
        code = self.halves.reshape(len(self.halves), -1) @ 3 ** np.arange(self.halves[:1].size)
        _, first, kind = np.unique(code, return_index=True, return_inverse=True)
        near, far = (space.ufl_element().sub_elements[0] for space in (fine, coarse))
        places = nodes.reference_points(fine)
        inside = 0.5 * np.einsum("nv,kvc->knc", places, self.halves[first])[:, :, 1:]
        values = far.tabulate(0, inside.reshape(-1, inside.shape[2]))[0].reshape(*inside.shape[:2], -1)
        weights = np.linalg.solve(near.tabulate(0, places[:, 1:])[0], values)
        weights[np.abs(weights) < ROUNDING] = 0.0
        cell, number = np.empty(owned, dtype=np.int64), np.empty(owned, dtype=np.int64)
        for k, column in enumerate(fine.dofmap.list[: len(self.parents)].T):
            here = np.flatnonzero(column < owned)
            cell[column[here]], number[column[here]] = here, k
        numbers = coarse.dofmap.index_map.local_to_global(coarse.dofmap.list[self.parents[cell]].ravel())
        return weighted_rows(numbers.reshape(owned, -1), weights[kind[cell], number], d)


class DegreeTransfer(Transfer):
    """From degree 1 to degree 2 on one mesh: exact."""

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> Rows:
        """The functions of degree 1, in the basis of degree 2. Local."""
        count, corners = coarse.dofmap.list.shape
        itself = np.broadcast_to(2 * np.eye(corners, dtype=np.int8), (count, corners, corners))
        return ParentCellTransfer(np.arange(count, dtype=np.int32), itself).rows(fine, coarse)


def renumbered(space: fem.FunctionSpace, own: Numbers, wanted: Numbers) -> Numbers:
    """PETSc's numbers of blocks which any rank may have. Collective.

    Args:
        space: of the blocks.
        own: other numbers of the blocks that this rank owns.
        wanted: the others' numbers to look for, of any shape.
    """
    places = np.arange(*space.dofmap.index_map.local_range, dtype=PETSc.IntType)
    order = PETSc.AO().createMemoryScalable(own.astype(PETSc.IntType), places, comm=space.mesh.comm)
    return order.app2petsc(wanted.ravel().astype(PETSc.IntType)).reshape(wanted.shape)


def weighted_rows(numbers: Numbers, weights: Array, d: int) -> Rows:
    """Compressed rows of a matrix of weighted sums, component by component.

    Args:
        numbers: block columns, (n, k).
        weights: of these, (n, k); zeros are left out.
        d: components.
    """
    n, k = numbers.shape
    shape = n, int(numbers.max(initial=-1)) + 1
    sums = sparse.csr_array((weights.ravel(), numbers.ravel(), np.arange(0, n * k + 1, k, dtype=numbers.dtype)), shape)
    sums.sum_duplicates()
    sums.eliminate_zeros()
    rows = sums[np.repeat(np.arange(n), d)]  # a Kronecker product takes six times as long
    columns = d * rows.indices + np.repeat(np.arange(n * d) % d, np.diff(rows.indptr))
    return rows.indptr.astype(PETSc.IntType), columns.astype(PETSc.IntType), rows.data


def _sizes(space: fem.FunctionSpace) -> tuple[int, int]:
    """Local and global number of unknowns."""
    d = space.dofmap.index_map_bs
    return space.dofmap.index_map.size_local * d, space.dofmap.index_map.size_global * d


def interpolation_weights(points: Array, space: fem.FunctionSpace) -> tuple[Integers, Array]:
    """The vertices of the cell that holds each point, and the point's weights of them. Collective.

    Each rank is sent the cells that may hold its points. A point outside of all cells is moved to the nearest one.

    Args:
        points: this rank's points, m, (m, 3).
        space: P1 on the mesh in which they are located.

    Returns:
        Global numbers of vertices (blocks), and barycentric weights, (m, d+1) both.
    """
    d = space.mesh.geometry.dim
    corners, numbers = _gathered(points, space)
    if not len(points):  # nor has it cells to look in
        return np.empty((0, d + 1), dtype=np.int64), np.empty((0, d + 1))
    distinct, local = np.unique(numbers, return_inverse=True)
    local = local.reshape(numbers.shape)
    x = np.empty((len(distinct), d))
    x[local] = corners
    kind = space.mesh.topology.cell_name()
    mesh = compat.simplex_mesh(MPI.COMM_SELF, local, x, kind)
    found = mesh.topology.original_cell_index[containing_cells(mesh, points)]
    weights = clipped(barycentric_weights(corners[found], points[:, :d]))
    return numbers[found], clipped(np.where(weights < ROUNDING, 0.0, weights))


def _gathered(points: Array, space: fem.FunctionSpace) -> tuple[Array, Integers]:
    """Corners (k, d+1, d) and their global numbers (k, d+1) of all cells near this rank's points. Collective."""
    comm, d = space.mesh.comm, space.mesh.geometry.dim
    blocks = space.dofmap.list
    corners = nodes.points(space)[blocks][:, :, :d]
    numbers = space.dofmap.index_map.local_to_global(blocks.ravel()).reshape(blocks.shape)
    low, high = corners.min(axis=1), corners.max(axis=1)
    widest = largest(comm, float(np.max(high - low, initial=0.0)))
    boxes = agree(comm, (points[:, :d].min(axis=0, initial=np.inf), points[:, :d].max(axis=0, initial=-np.inf)))
    wanted = [np.all((high >= a - widest) & (low <= b + widest), axis=1) for a, b in boxes]
    found = comm.alltoall([(corners[w], numbers[w]) for w in wanted])
    return np.concatenate([c for c, _ in found]), np.concatenate([n for _, n in found])


def containing_cells(mesh: dolfinx.mesh.Mesh, points: Array) -> Integers:
    """The cell that holds each point, or the one nearest to it.

    Among the cells whose boxes hold the point, it is the one whose smallest barycentric weight is largest: dolfinx's
    own collision test also takes cells that miss the point by a millionth of their size.

    Args:
        mesh: a mesh of this process alone.
        points: m, (m, 3).
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
    outside = np.flatnonzero(best < -ROUNDING)
    if len(outside):
        everything = np.arange(mesh.topology.index_map(d).size_local, dtype=np.int32)
        middles = geometry.create_midpoint_tree(mesh, d, everything)
        found[outside] = geometry.compute_closest_entity(tree, middles, mesh, points[outside])
    return found


def clipped(weights: Array) -> Array:
    """Barycentric weights (..., c) moved into the simplex: none is negative, and their sum is 1."""
    positive = np.clip(weights, 0.0, 1.0)
    return positive / positive.sum(axis=-1, keepdims=True)


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
    return nodes.to_barycentric(rest)
