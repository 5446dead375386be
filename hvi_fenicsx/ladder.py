"""The ladder: nested meshes of the built-in blocks, and P1 prolongation between neighbouring rungs.

A rung below has half the cells each way. It serves as start for the finer one, and its prolongation builds the
geometric multigrid. ``create_rectangle``'s right-diagonal pattern (and ``create_box``'s of tetrahedra) is nested in
itself: each fine vertex is a coarse one or the midpoint of a coarse edge.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from petsc4py import PETSc

if TYPE_CHECKING:
    from .scene import Scene

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
_COARSEST = 8
"""Cells each way below which no coarser rung helps."""


def coarser(scene: Scene) -> Scene | None:
    """The scene one rung below; None where the mesh has no such rung."""
    cells = getattr(scene.domain, "cells", None)
    if cells is None or any(n % 2 or n // 2 < _COARSEST for n in cells):
        return None
    domain = scene.domain.model_copy(update={"cells": tuple(n // 2 for n in cells)})
    return scene.model_copy(update={"domain": domain})


def prolongation(fine: fem.FunctionSpace, coarse: fem.FunctionSpace, scene: Scene) -> PETSc.Mat:
    """P1 prolongation of vector fields between neighbouring rungs of a scene's block (its ``scene`` is the fine one).

    Rows are the fine unknowns, columns the coarse ones. Collective.
    """
    cells = np.array(scene.domain.cells)  # type: ignore[union-attr]
    place = _grid(fine, cells, scene)
    parents, weights = _parents(place)
    numbers = _numbers(coarse, cells // 2, scene)
    pairs = numbers.app2petsc(_flat(parents, cells // 2).astype(PETSc.IntType).ravel()).reshape(-1, 2)
    rows = _rows(pairs, weights, fine.dofmap.index_map_bs)
    matrix = PETSc.Mat().createAIJ((_sizes(fine), _sizes(coarse)), csr=rows, comm=fine.mesh.comm)
    matrix.assemble()
    return matrix


def _rows(pairs: Indices, weights: Array, d: int) -> tuple[Indices, Indices, Array]:
    """Compressed rows of the matrix that takes the weighted pair of block columns, component by component."""
    entries = np.where(weights == 1.0, 1, 2).repeat(d)
    columns = np.sort(pairs, axis=1)[:, None, :] * d + np.arange(d)[:, None]
    kept = np.ones((len(pairs), d, 2), dtype=bool)
    kept[weights == 1.0, :, 1] = False
    values = np.broadcast_to(weights[:, None, None], columns.shape)
    start = np.concatenate([[0], np.cumsum(entries)])
    return start.astype(PETSc.IntType), columns[kept].astype(PETSc.IntType), np.ascontiguousarray(values[kept])


def _sizes(space: fem.FunctionSpace) -> tuple[int, int]:
    d = space.dofmap.index_map_bs
    return space.dofmap.index_map.size_local * d, space.dofmap.index_map.size_global * d


def _grid(space: fem.FunctionSpace, cells: npt.NDArray[np.int64], scene: Scene) -> Indices:
    """Integer grid coordinates of the vertices that this rank owns, (n, dim)."""
    owned = space.dofmap.index_map.size_local
    size = np.array(scene.domain.size)  # type: ignore[union-attr]
    points = space.tabulate_dof_coordinates()[:owned, : len(size)]
    return np.asarray(np.rint(points / size * cells), dtype=np.int64)


def _parents(place: Indices) -> tuple[Indices, Array]:
    """The two coarse vertices (n, 2, dim) whose mean a fine vertex is, and the weight of each (1 where they coincide).

    Odd coordinates run along a coarse edge from its lower to its upper end: an axis, or the diagonal of a face or cell.
    """
    low, high = place // 2, (place + 1) // 2
    weight = np.where(np.all(low == high, axis=1), 1.0, 0.5)
    return np.stack([low, high], axis=1), weight


def _flat(place: Indices, cells: npt.NDArray[np.int64]) -> Indices:
    strides = np.concatenate([[1], np.cumprod(cells[:-1] + 1)])
    return np.asarray(place @ strides)


def _numbers(space: fem.FunctionSpace, cells: npt.NDArray[np.int64], scene: Scene) -> PETSc.AO:
    """From grid numbers to PETSc's (block) numbers. Collective."""
    application = _flat(_grid(space, cells, scene), cells).astype(PETSc.IntType)
    start, end = space.dofmap.index_map.local_range
    return PETSc.AO().createMemoryScalable(
        application, np.arange(start, end, dtype=PETSc.IntType), comm=space.mesh.comm
    )
