"""The ladder: a row of ever finer meshes, and P1 prolongation between neighbouring rungs.

A rung serves as start for the finer one, and the prolongation builds the geometric multigrid. Where they are nested,
each vertex of the finer one is a vertex of the coarser one or the midpoint of an edge: between a mesh and its
refinement (:mod:`.refinement`), and between built-in blocks of which one has half the cells each way,
``create_rectangle``'s right-diagonal pattern (and ``create_box``'s of tetrahedra) being nested in itself. Onto a mesh
that is not nested (:mod:`.coarsening_2d`) it is linear interpolation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from petsc4py import PETSc

from ..system.coarser_level import Below
from ..system.system import System
from ..typing import Array
from . import point_location, vertex_dofs
from .domain import Refinement

if TYPE_CHECKING:
    from ..scene import Scene

Indices = npt.NDArray[np.integer]
Rows = tuple[Indices, Indices, Array]
"""Of a sparse matrix, compressed: where each begins, columns, values."""
_COARSEST = 8
"""Cells each way below which no coarser rung helps."""
_GROWTH = 3.0
"""Of the unknowns, from one level of a multigrid to the next."""


def coarser(scene: Scene) -> Scene | None:
    """The scene of a block one rung below; None where there is no such rung."""
    cells = getattr(scene.domain, "cells", None)
    if cells is None or any(n % 2 or n // 2 < _COARSEST for n in cells):
        return None
    return scene.with_domain(cells=tuple(n // 2 for n in cells))


def prolongation(
    fine: fem.FunctionSpace,
    coarse: fem.FunctionSpace,
    nesting: Scene | Refinement | None,
    points: tuple[Array, Array] | None = None,
) -> PETSc.Mat:
    """P1 prolongation of vector fields between neighbouring rungs, in Cartesian components. Collective.

    Args:
        fine, coarse: the P1 vector spaces.
        nesting: how the fine mesh came from the coarse one: by refinement, or as the block of this (fine) scene; None
            where they are not nested.
        points: the local vertices of both, m, (n, 3), where they are at hand.

    Returns:
        Rows are the fine unknowns, columns the coarse ones.
    """
    d = fine.dofmap.index_map_bs
    if isinstance(nesting, Refinement):
        rows = _rows(_parents_by_cell(fine, coarse, nesting), d)
    else:
        near, far = points or (vertex_dofs.points(fine), vertex_dofs.points(coarse))
        near = near[: fine.dofmap.index_map.size_local]
        if nesting is None:
            rows = _interpolating(*point_location.between(near, coarse, far), d)
        else:
            rows = _rows(_parents_on_grid(near, coarse, far, nesting), d)
    # The rows are used in place: PETSc would insert them one by one.
    used = rows if fine.mesh.comm.size == 1 else _split(*rows, coarse)
    matrix = PETSc.Mat().createAIJWithArrays((_sizes(fine), _sizes(coarse)), used, comm=fine.mesh.comm)
    matrix.assemble()
    return matrix


def between(fine: System, coarse: System, nesting: Scene | Refinement | None) -> PETSc.Mat:
    """The prolongation between the unknowns of two systems, local ones where normals are slanted. Collective."""
    points = fine.problem.points, coarse.problem.points
    step = prolongation(fine.problem.space, coarse.problem.space, nesting, points)
    if coarse.rotation is not None:
        step = step.matMult(coarse.rotation)
    return step if fine.rotation is None else fine.rotation.transposeMatMult(step)


def stacked(step: PETSc.Mat, below: System) -> Below:
    """A hierarchy with one more rung; one of nearly the same size is passed over. Collective.

    Multigrid wants levels that grow by a factor, or a cycle costs more than a few sweeps of the finest.
    """
    if below.below is None or step.size[0] >= _GROWTH * below.below.prolongation.size[1]:
        return Below(below, step)
    return Below(below.below.system, step.matMult(below.below.prolongation))


def _parents_by_cell(fine: fem.FunctionSpace, coarse: fem.FunctionSpace, nesting: Refinement) -> Indices:
    """The two coarse vertices (global numbers) whose mean each owned fine vertex is; one twice for a coarse one."""
    corners = nesting.halves.shape[1]
    halves = nesting.halves.reshape(-1, corners)
    ends = np.argmax(halves > 0, axis=1), corners - 1 - np.argmax(halves[:, ::-1] > 0, axis=1)
    above = coarse.dofmap.list[nesting.parents].repeat(corners, axis=0)
    row = np.arange(len(above))
    found = np.column_stack([above[row, end] for end in ends]).astype(np.int32)
    vertices, owned = fine.dofmap.list[: len(nesting.parents)].ravel(), fine.dofmap.index_map.size_local
    local = np.empty((owned, 2), dtype=np.int32)
    local[vertices[vertices < owned]] = found[vertices < owned]
    return np.asarray(coarse.dofmap.index_map.local_to_global(local.ravel()), dtype=PETSc.IntType).reshape(-1, 2)


def _parents_on_grid(points: Array, coarse: fem.FunctionSpace, far: Array, scene: Scene) -> Indices:
    """The same for a block, of the fine vertices at these points.

    Odd coordinates run along a coarse edge from its lower to its upper end: an axis, or the diagonal of a face or cell.
    """
    cells = np.array(scene.domain.cells, dtype=PETSc.IntType)  # type: ignore[attr-defined]
    place = _grid(points, cells, scene)
    parents = np.stack([_flat(end, cells // 2) for end in (place // 2, (place + 1) // 2)], axis=1)
    return np.asarray(_numbers(coarse, far, cells // 2, scene).app2petsc(parents.ravel()).reshape(-1, 2))


def _rows(pairs: Indices, d: int) -> Rows:
    """Compressed rows of the matrix that takes the mean of each pair of block columns, component by component."""
    low, high = np.minimum(pairs[:, 0], pairs[:, 1]), np.maximum(pairs[:, 0], pairs[:, 1])
    entries = np.repeat(1 + (low < high).astype(np.int8), d)
    start = np.concatenate([[0], np.cumsum(entries)]).astype(PETSc.IntType)
    columns, component = np.empty(start[-1], PETSc.IntType), np.arange(d, dtype=PETSc.IntType)
    columns[start[:-1]] = (low[:, None] * d + component).ravel()
    columns[start[1:] - 1] = (high[:, None] * d + component).ravel()
    return start, columns, np.repeat(1.0 / entries, entries)


def _interpolating(corners: Indices, weights: Array, d: int) -> Rows:
    """The same of the matrix that weighs the block columns ``corners`` (n, c)."""
    order = np.argsort(corners, axis=1)
    columns = np.take_along_axis(corners, order, axis=1)[:, None, :] * d + np.arange(d)[None, :, None]
    start = np.arange(0, columns.size + 1, corners.shape[1])
    values = np.broadcast_to(np.take_along_axis(weights, order, axis=1)[:, None, :], columns.shape).ravel()
    return start.astype(PETSc.IntType), columns.ravel().astype(PETSc.IntType), values


def _split(start: Indices, columns: Indices, values: Array, coarse: fem.FunctionSpace) -> tuple[Rows, Rows]:
    """Compressed rows as PETSc keeps them on several ranks: this rank's columns, counted from its first, and others."""
    first, last = (end * coarse.dofmap.index_map_bs for end in coarse.dofmap.index_map.local_range)
    own = (columns >= first) & (columns < last)
    before = np.concatenate([[0], np.cumsum(own)])[start].astype(PETSc.IntType)
    return (before, columns[own] - PETSc.IntType(first), values[own]), (start - before, columns[~own], values[~own])


def _sizes(space: fem.FunctionSpace) -> tuple[int, int]:
    d = space.dofmap.index_map_bs
    return space.dofmap.index_map.size_local * d, space.dofmap.index_map.size_global * d


def _grid(points: Array, cells: Indices, scene: Scene) -> Indices:
    """Integer grid coordinates of vertices, (n, dim)."""
    size = np.array(scene.domain.size)  # type: ignore[attr-defined]
    return np.rint(points[:, : len(size)] * (cells / size)).astype(PETSc.IntType)


def _flat(place: Indices, cells: Indices) -> Indices:
    strides = np.concatenate([[1], np.cumprod(cells[:-1] + 1)]).astype(PETSc.IntType)
    return sum((place[:, i] * step for i, step in enumerate(strides)), start=np.zeros(len(place), PETSc.IntType))


def _numbers(space: fem.FunctionSpace, points: Array, cells: Indices, scene: Scene) -> PETSc.AO:
    """From grid numbers to PETSc's (block) numbers. Collective."""
    start, end = space.dofmap.index_map.local_range
    application = _flat(_grid(points[: end - start], cells, scene), cells)
    return PETSc.AO().createMemoryScalable(
        application, np.arange(start, end, dtype=PETSc.IntType), comm=space.mesh.comm
    )
