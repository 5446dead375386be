"""Rectangles and boxes of equal cells, each rank making the part that it keeps.

Each cell of the grid is cut along the paths of edges from its lowest to its highest corner (Kuhn 1960): in the plane
``create_rectangle``'s right-diagonal pattern, in space ``create_box``'s six tetrahedra, both nested in themselves. The
ranks share a block by recursive bisection (Berger and Bokhari 1987). It cuts at fractions of the block, rounded to
cells, so that a rank has the same part on every level of the mesh hierarchy, to half a cell, and hardly a value is sent
between levels; a graph partitioner would have to run on each level, and would cut each level elsewhere.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..typing import Array, Entities, Integers
from . import grid_facets, grid_parts
from .domain import Domain
from .grid_transfer import GridTransfer, NestedGridTransfer
from .thresholds import DEFAULT, Thresholds
from .transfer import Transfer

_AXIS_OF_SIDE = {"left": (0, 0), "right": (0, 1), "bottom": (-1, 0), "top": (-1, 1), "front": (1, 0), "back": (1, 1)}
"""Axis (-1: the last, the vertical one) and end of each named side."""


def block(
    comm: MPI.Comm,
    size: Sequence[float],
    cells: Sequence[int],
    thresholds: Thresholds = DEFAULT,
    reflected: Sequence[int] = (),
) -> Domain:
    """The rectangle or box [0, size], in cells cut into triangles or tetrahedra. Collective.

    Each coarser level of its mesh hierarchy has half the cells each way, or nearly (:func:`coarser_cells`).

    Args:
        comm: the ranks that share it.
        size: lengths of the edges, m, (d,).
        cells: cells each way, (d,).
        thresholds: how coarse the coarsest level is.
        reflected: axes along which the parts of the ranks are reflected.
    """
    grid, upper = mesh(comm, size, cells, reflected), np.asarray(size, dtype=float)
    coarser = coarser_cells(cells, thresholds)

    def coarsening() -> tuple[Domain, Transfer]:
        assert coarser is not None
        nested = all(2 * few == n for few, n in zip(coarser, cells, strict=True))
        kind = NestedGridTransfer if nested else GridTransfer
        return block(comm, size, coarser, thresholds, reflected), kind(size, coarser)

    return Domain(
        mesh=grid,
        sides=_sides(grid, upper),
        regions={},
        lower=np.zeros(len(upper)),
        upper=upper,
        one_piece=True,
        coarsening=coarsening if coarser is not None else None,
        reflected=lambda axes: block(comm, size, cells, thresholds, axes),
    )


def coarser_cells(cells: Sequence[int], thresholds: Thresholds = DEFAULT) -> list[int] | None:
    """The cells each way of the next coarser block; None where it would not pay.

    They are halved, so that the blocks are nested. Of a large block of which they cannot be halved, the coarser one has
    nearly half of them, such that these can be halved as often as possible.

    Args:
        cells: cells each way, (d,).
        thresholds: how coarse the coarsest level is, and what is large.
    """
    if all(n % 2 == 0 for n in cells):
        fewer = [n // 2 for n in cells]
    elif len(cells) * math.prod(n + 1 for n in cells) >= thresholds.uneven_from:
        fewer = [_often_halved(n / 2, thresholds.uneven_half) for n in cells]
    else:
        return None
    return fewer if min(fewer) >= thresholds.coarsest_block else None


def _often_halved(wanted: float, share: float) -> int:
    """The number near to the one wanted, up to a share of it, that can be halved most often."""
    step = 1
    while abs(round(wanted / (2 * step)) * 2 * step - wanted) <= share * wanted:
        step *= 2
    return round(wanted / step) * step


def mesh(comm: MPI.Comm, size: Sequence[float], cells: Sequence[int], reflected: Sequence[int] = ()) -> dmesh.Mesh:
    """The mesh of the rectangle or box [0, size], without ghost cells. Collective.

    Args:
        comm: the ranks that share it.
        size: lengths of the edges, m, (d,).
        cells: cells each way, (d,), each cut into triangles or tetrahedra.
        reflected: axes along which the parts of the ranks are reflected.
    """
    if not compat.TAKES_TOPOLOGY:
        lower, upper = part_of_rank(cells, comm.size, comm.rank, reflected)
        kind, simplices = {2: "triangle", 3: "tetrahedron"}[len(cells)], _simplices(lower, upper, cells)
        return compat.simplex_mesh(comm, simplices, _points(comm, size, cells), kind)
    parts = [part_of_rank(cells, comm.size, rank, reflected) for rank in range(comm.size)]
    lower, upper = parts[comm.rank]
    own, counts = grid_parts.vertices(comm, parts), upper - lower
    numbers = _simplices(np.zeros_like(counts), counts, counts)
    lines = [np.linspace(0.0, s, n + 1)[at] for s, n, at in zip(size, cells, own.places.T, strict=True)]
    whole = comm.size == 1  # dolfinx alone can say which facets ranks share
    return compat.mesh_of_cells(
        comm,
        np.column_stack(lines),
        own.local[numbers],
        index_map=(own.owned, own.ghosts, own.owners),
        inputs=_flat(own.places, cells),
        facets=grid_facets.facets(numbers, _steps(counts), len(own.local)) if whole else None,
    )


def part_of_rank(
    cells: Sequence[int], ranks: int, rank: int, reflected: Sequence[int] = ()
) -> tuple[Integers, Integers]:
    """The part of the grid that a rank keeps.

    Args:
        cells: cells each way, (d,).
        ranks: number of ranks.
        rank: the rank.
        reflected: axes along which the parts of all ranks are reflected.

    Returns:
        The first cell, and the one after the last, (d,) both; they are equal where there are too few cells.
    """
    lower, upper = np.zeros(len(cells)), np.ones(len(cells))
    first, last = 0, ranks
    while last - first > 1:
        middle = (first + last + 1) // 2
        extent = (upper - lower) * cells
        axis = len(extent) - 1 - np.argmax(extent[::-1])  # of equal ones the last, so that the bottom stays whole
        cut = lower[axis] + (upper[axis] - lower[axis]) * (middle - first) / (last - first)
        if rank < middle:
            upper[axis], last = cut, middle
        else:
            lower[axis], first = cut, middle
    for turned in reflected:
        lower[turned], upper[turned] = 1.0 - upper[turned], 1.0 - lower[turned]
    begin, end = (np.floor(place * cells + 0.5).astype(np.int64) for place in (lower, upper))
    return begin, end


def _simplices(lower: Integers, upper: Integers, cells: Sequence[int] | Integers) -> Integers:
    """The simplices of a part of the grid, (n, d+1), as numbers of the grid's vertices, x running fastest."""
    steps, corners = _steps(cells), np.zeros(1, np.int64)
    for begin, end, step in zip(lower, upper, steps, strict=True):
        corners = np.add.outer(np.arange(begin, end) * step, corners).ravel()
    paths = np.array([np.cumsum([0, *path]) for path in itertools.permutations(steps)])
    return np.asarray((corners[:, None, None] + paths).reshape(-1, len(cells) + 1))


def _steps(cells: Sequence[int] | Integers) -> list[int]:
    """From a vertex of the grid to the next one along each axis."""
    return [math.prod(int(n) + 1 for n in cells[:axis]) for axis in range(len(cells))]


def _flat(places: Integers, cells: Sequence[int]) -> Integers:
    """The numbers of the grid's vertices, x running fastest, (n,)."""
    return np.asarray(places @ np.array(_steps(cells), dtype=np.int64))


def _points(comm: MPI.Comm, size: Sequence[float], cells: Sequence[int]) -> Array:
    """An equal part of the grid's vertices by their numbers, m, (n, d); dolfinx sends each where it is needed."""
    counts = [n + 1 for n in cells]
    total = int(np.prod(counts, dtype=np.int64))
    numbers = np.arange(total * comm.rank // comm.size, total * (comm.rank + 1) // comm.size)
    places = np.unravel_index(numbers, counts, order="F")
    return np.column_stack([np.linspace(0.0, s, n)[at] for s, n, at in zip(size, counts, places, strict=True)])


def _sides(mesh: dmesh.Mesh, size: Array) -> dict[str, Entities]:
    """Exterior facets by the side that their midpoint lies on."""
    d = len(size)
    mesh.topology.create_connectivity(d - 1, d)
    facets, middles = dmesh.exterior_facet_indices(mesh.topology), np.empty((0, 3))
    if len(facets):  # dolfinx divides by their number
        middles = dmesh.compute_midpoints(mesh, d - 1, facets)
    ends = {n: (axis % d, end) for n, (axis, end) in _AXIS_OF_SIDE.items() if d == 3 or n not in ("front", "back")}
    return {name: facets[np.abs(middles[:, i] - end * size[i]) < 1e-9 * size[i]] for name, (i, end) in ends.items()}
