"""The transfer between blocks of equal cells, whose vertices are known by their places in the grid.

A cell is cut along the paths of edges from its lowest to its highest corner (Kuhn 1960). So blocks of which one has
half the cells each way are nested, and the simplex that holds a point is known from the order of its coordinates in the
cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..typing import Array
from .blocks import _flat
from .transfer import Numbers, Rows, Transfer, mean_rows, weighted_rows


@dataclass(frozen=True)
class NestedGridTransfer(Transfer):
    """From a block of half the cells each way to a block.

    Attributes:
        size: lengths of the block's edges, m, (d,).
        coarser_cells: cells each way of the coarser block, (d,).
    """

    size: Sequence[float]
    coarser_cells: Sequence[int]

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace, points: tuple[Array, Array]) -> Rows:
        """Each fine vertex is the mean of the two ends of a coarse edge. Collective.

        Odd coordinates run along a coarse edge from its lower to its upper end: an axis, or the diagonal of a face or
        of a cell.
        """
        near, far = points
        cells = np.array(self.coarser_cells, dtype=PETSc.IntType)
        place = np.rint(_grid_places(near, self.size, 2 * cells)).astype(PETSc.IntType)
        parents = np.stack([_flat(end, cells) for end in (place // 2, (place + 1) // 2)], axis=1)
        pairs = _numbered(parents, coarse, far, self.size, cells)
        return mean_rows(pairs, fine.dofmap.index_map_bs)


@dataclass(frozen=True)
class GridTransfer(Transfer):
    """From a block to one of any other numbers of cells: linear interpolation.

    Attributes:
        size: lengths of the block's edges, m, (d,).
        coarser_cells: cells each way of the coarser block, (d,).
    """

    size: Sequence[float]
    coarser_cells: Sequence[int]

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace, points: tuple[Array, Array]) -> Rows:
        """Each fine vertex has barycentric weights in the coarse simplex that holds it. Collective."""
        near, far = points
        cells = np.array(self.coarser_cells, dtype=PETSc.IntType)
        place = _grid_places(near, self.size, cells)
        corner = np.clip(np.floor(place), 0, cells - 1).astype(PETSc.IntType)
        within = np.clip(place - corner, 0.0, 1.0)
        order = np.argsort(-within, axis=1)  # the path to the highest corner takes the largest coordinate first
        falling = np.take_along_axis(within, order, axis=1)
        ends = np.ones((len(place), 1)), np.zeros((len(place), 1))
        weights = -np.diff(np.hstack([ends[0], falling, ends[1]]), axis=1)
        ways = np.cumsum(np.eye(len(cells), dtype=PETSc.IntType)[order], axis=1, dtype=PETSc.IntType)
        corners = np.concatenate([corner[:, None], corner[:, None] + ways], axis=1)
        numbers = _flat(corners.reshape(-1, len(cells)), cells).reshape(weights.shape)
        return weighted_rows(_numbered(numbers, coarse, far, self.size, cells), weights, fine.dofmap.index_map_bs)


def _grid_places(points: Array, size: Sequence[float], cells: Numbers) -> Array:
    """Grid coordinates of points, (n, d)."""
    return np.asarray(points[:, : len(size)] * (cells / np.array(size)))


def _numbered(flat: Numbers, space: fem.FunctionSpace, points: Array, size: Sequence[float], cells: Numbers) -> Numbers:
    """PETSc's (block) numbers of grid vertices, which any rank may have. Collective."""
    start, end = space.dofmap.index_map.local_range
    own = np.rint(_grid_places(points[: end - start], size, cells)).astype(PETSc.IntType)
    found = PETSc.AO().createMemoryScalable(
        _flat(own, cells).astype(PETSc.IntType), np.arange(start, end, dtype=PETSc.IntType), comm=space.mesh.comm
    )
    return np.asarray(found.app2petsc(flat.ravel().astype(PETSc.IntType)).reshape(flat.shape))
