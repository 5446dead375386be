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
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..geometry import ROUNDING
from ..typing import Array, Entities, Integers, Mask
from . import facets as cell_facets
from . import nodes
from .domain import DEFAULT, Domain
from .transfer import Numbers, Rows, Transfer, renumbered, weighted_rows

_AXIS_OF_SIDE = {"left": (0, 0), "right": (0, 1), "bottom": (-1, 0), "top": (-1, 1), "front": (1, 0), "back": (1, 1)}
"""Axis (-1: the last, the vertical one) and end of each named side."""


def block(comm: MPI.Comm, size: Sequence[float], cells: Sequence[int]) -> Domain:
    """The rectangle or box [0, size], in cells cut into triangles or tetrahedra. Collective.

    Each coarser level of its mesh hierarchy has half the cells each way, or nearly (:func:`coarser_cells`).

    Args:
        comm: the ranks that share it.
        size: lengths of the edges, m, (d,).
        cells: cells each way, (d,).
    """
    grid, upper = mesh(comm, size, cells), np.asarray(size, dtype=float)
    coarser = coarser_cells(cells)

    def coarsening() -> tuple[Domain, Transfer]:
        assert coarser is not None
        return block(comm, size, coarser), GridTransfer(size, cells, coarser)

    return Domain(
        mesh=grid,
        sides=_sides(grid, upper),
        regions={},
        lower=np.zeros(len(upper)),
        upper=upper,
        one_piece=True,
        coarsening=coarsening if coarser is not None else None,
    )


def coarser_cells(cells: Sequence[int]) -> list[int] | None:
    """The cells each way of the next coarser block; None where it would not pay.

    They are halved, so that the blocks are nested. Of a large block of which they cannot be halved, the coarser one has
    nearly half of them, such that these can be halved twice.

    Args:
        cells: cells each way, (d,).
    """
    if all(n % 2 == 0 for n in cells):
        fewer = [n // 2 for n in cells]
    elif len(cells) * math.prod(n + 1 for n in cells) >= DEFAULT.coarsest:
        fewer = [4 * round(n / 8) for n in cells]
    else:
        return None
    return fewer if min(fewer) >= DEFAULT.coarsest_block else None


def mesh(comm: MPI.Comm, size: Sequence[float], cells: Sequence[int]) -> dmesh.Mesh:
    """The mesh of the rectangle or box [0, size], without ghost cells. Collective.

    Args:
        comm: the ranks that share it.
        size: lengths of the edges, m, (d,).
        cells: cells each way, (d,), each cut into triangles or tetrahedra.
    """
    if not compat.TAKES_TOPOLOGY:
        lower, upper = part_of_rank(cells, comm.size, comm.rank)
        kind, simplices = {2: "triangle", 3: "tetrahedron"}[len(cells)], _simplices(lower, upper, cells)
        return compat.simplex_mesh(comm, simplices, _points(comm, size, cells), kind)
    parts = [part_of_rank(cells, comm.size, rank) for rank in range(comm.size)]
    lower, upper = parts[comm.rank]
    (places, local, index_map), counts = vertices(comm, parts), upper - lower
    numbers = _simplices(np.zeros_like(counts), counts, counts)
    lines = [np.linspace(0.0, s, n + 1)[at] for s, n, at in zip(size, cells, places.T, strict=True)]
    whole = comm.size == 1  # dolfinx alone can say which facets ranks share
    return compat.mesh_of_cells(
        comm,
        np.column_stack(lines),
        local[numbers],
        index_map=index_map,
        inputs=_flat(places, cells),
        facets=facets(numbers, _steps(counts), len(local)) if whole else None,
    )


def part_of_rank(cells: Sequence[int], ranks: int, rank: int) -> tuple[Integers, Integers]:
    """The part of the grid that a rank keeps.

    Args:
        cells: cells each way, (d,).
        ranks: number of ranks.
        rank: the rank.

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
    begin, end = (np.floor(place * cells + 0.5).astype(np.int64) for place in (lower, upper))
    return begin, end


def _simplices(lower: Integers, upper: Integers, cells: Sequence[int] | Integers) -> Integers:
    """The simplices of a part of the grid, (n, d+1), as numbers of the grid's vertices, x running fastest."""
    steps, corners = _steps(cells), np.zeros(1, np.int64)
    for begin, end, step in zip(lower, upper, steps, strict=True):
        corners = np.add.outer(np.arange(begin, end) * step, corners).ravel()
    paths = np.array([np.cumsum([0, *path]) for path in itertools.permutations(steps)])
    return (corners[:, None, None] + paths).reshape(-1, len(cells) + 1)


def _steps(cells: Sequence[int] | Integers) -> list[int]:
    """From a vertex of the grid to the next one along each axis."""
    return [math.prod(int(n) + 1 for n in cells[:axis]) for axis in range(len(cells))]


def _flat(places: Integers, cells: Sequence[int] | Integers) -> Integers:
    """The numbers of the grid's vertices, x running fastest, (n,)."""
    return places @ np.array(_steps(cells), dtype=np.int64)


def _points(comm: MPI.Comm, size: Sequence[float], cells: Sequence[int]) -> Array:
    """An equal part of the grid's vertices by their numbers, m, (n, d); dolfinx sends each where it is needed."""
    counts = [n + 1 for n in cells]
    total = int(np.prod(counts, dtype=np.int64))
    numbers = np.arange(total * comm.rank // comm.size, total * (comm.rank + 1) // comm.size)
    places = np.unravel_index(numbers, counts, order="F")
    return np.column_stack([np.linspace(0.0, s, n)[at] for s, n, at in zip(size, counts, places, strict=True)])


def _sides(mesh: dmesh.Mesh, size: Array) -> dict[str, Entities]:
    """Exterior facets by the side that their midpoint lies on."""
    d, facets = len(size), cell_facets.exterior(mesh)
    middles = cell_facets.corners(mesh, facets).mean(axis=1)
    ends = {n: (axis % d, end) for n, (axis, end) in _AXIS_OF_SIDE.items() if d == 3 or n not in ("front", "back")}
    return {name: facets[np.abs(middles[:, i] - end * size[i]) < ROUNDING * size[i]] for name, (i, end) in ends.items()}


def facets(simplices: Integers, steps: Sequence[int], vertices: int) -> tuple[Entities, Entities]:
    """The facets of a grid's simplices.

    Args:
        simplices: by their vertices, (c, d+1), ascending; the paths of one cell follow each other, in the order of the
            permutations of the steps.
        steps: from a vertex to the next one along each axis, (d,).
        vertices: number of vertices.

    Returns:
        The vertices of each facet, (f, d), ascending; the facets of each simplex, (c, d+1), facet i being opposite to
        vertex i.
    """
    d, paths = len(steps), [np.cumsum([0, *path]) for path in itertools.permutations(steps)]
    shortened = [[tuple(np.delete(path - path[int(i == 0)], i)) for i in range(d + 1)] for path in paths]
    kinds = {kind: number for number, kind in enumerate(dict.fromkeys(itertools.chain(*shortened)))}
    own = np.array([[kinds[kind] for kind in row] for row in shortened], dtype=np.int32)
    first = simplices[:, [1, *[0] * d]].reshape(-1, len(paths), d + 1)
    keys = (first + own * vertices).reshape(-1, d + 1)
    there = np.zeros(len(kinds) * vertices, dtype=np.bool_)
    there[keys] = True
    found, numbered = np.flatnonzero(there), np.cumsum(there, dtype=np.int32) - 1
    ways = np.array(list(kinds), dtype=np.int64)
    corners = found[:, None] % vertices + ways[found // vertices]
    return corners.astype(np.int32), numbered[keys].astype(np.int32)


Box = tuple[Integers, Integers]
"""The first cell of a part, and the one after the last, (d,) both."""


def vertices(comm: MPI.Comm, parts: Sequence[Box]) -> tuple[Integers, Entities, tuple[int, Integers, Entities]]:
    """The vertices of this rank's part. Collective.

    Args:
        comm: the ranks.
        parts: of all ranks; those without cells have no vertices.

    Returns:
        Their integer coordinates in the grid, those that the rank owns first, (n, d); the local number of each vertex
        of the part's own grid, x running fastest, (n,); how many the rank owns, the global numbers of the others, and
        their owners.
    """
    owner = _owners(parts, comm.rank)
    own = owner == comm.rank
    order = np.argsort(~own, kind="stable")
    local = np.empty(len(order), dtype=np.int32)
    local[order] = np.arange(len(order), dtype=np.int32)
    owned = int(np.count_nonzero(own))
    first = np.concatenate([[0], np.cumsum(comm.allgather(owned))])
    places, others = _places(parts[comm.rank])[order], owner[order[owned:]]
    ghosts = np.empty(len(others), dtype=np.int64)
    for rank in np.unique(others):
        at = others == rank
        ghosts[at] = first[rank] + _numbers_of_owner(parts, int(rank), places[owned:][at])
    return places, local, (owned, ghosts, others.astype(np.int32))


def _places(part: Box) -> Integers:
    """The integer coordinates of a part's vertices, x running fastest, (n, d); none where it has no cells."""
    extent = part[1] - part[0]
    counts = np.where(np.all(extent > 0), extent + 1, 0)
    return np.stack(np.unravel_index(np.arange(counts.prod()), counts, order="F"), axis=1) + part[0]


def _owners(parts: Sequence[Box], rank: int) -> Integers:
    """The rank that owns each vertex of a part, x running fastest, (n,): the first of those that have it."""
    places, (lower, upper) = _places(parts[rank]), parts[rank]
    owner = np.full(len(places), rank)
    for other in reversed(range(rank)):
        begin, end = parts[other]
        if np.all((begin <= upper) & (end >= lower) & (end > begin)):
            owner[np.all((places >= begin) & (places <= end), axis=1)] = other
    return owner


def _numbers_of_owner(parts: Sequence[Box], rank: int, places: Integers) -> Integers:
    """The numbers that a rank gives to vertices which it owns, counted from 0, (g,)."""
    own: Mask = _owners(parts, rank) == rank
    lower, upper = parts[rank]
    return (np.cumsum(own) - 1)[_flat(places - lower, upper - lower)]


@dataclass(frozen=True)
class GridTransfer(Transfer):
    """From a block to the same block in finer cells: linear interpolation.

    Attributes:
        size: lengths of the block's edges, m, (d,).
        cells: each way of the finer block, (d,).
        coarser_cells: each way of the coarser block, (d,).
    """

    size: Sequence[float]
    cells: Sequence[int]
    coarser_cells: Sequence[int]

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> Rows:
        """Each fine vertex has barycentric weights in the coarse simplex that holds it. Collective."""
        cells = np.array(self.coarser_cells)
        near, far = _grid_places(fine, self.size, self.cells), _grid_places(coarse, self.size, cells)
        if np.array_equal(2 * cells, self.cells):  # the mean of the ends of an edge, of whatever direction
            ends = np.stack([near // 2, (near + 1) // 2], axis=1)
            weights: Array = np.full((len(near), 2), 0.5)
        else:
            ends, weights = _in_simplices(near * cells / np.array(self.cells), cells)
        return weighted_rows(
            renumbered(coarse, _flat(far, cells), _flat(ends, cells)), weights, fine.dofmap.index_map_bs
        )


def _in_simplices(places: Array, cells: Integers) -> tuple[Integers, Array]:
    """The corners (n, d+1, d) of the grid's simplices that hold places, and the weights of these, (n, d+1)."""
    corner = np.minimum(places.astype(np.int64), cells - 1)
    within = places - corner
    order = np.argsort(-within, axis=1)  # the path to the highest corner takes the largest coordinate first
    falling = np.pad(np.take_along_axis(within, order, axis=1), ((0, 0), (1, 1)), constant_values=((0, 0), (1, 0)))
    ways = np.pad(np.cumsum(np.eye(len(cells), dtype=np.int64)[order], axis=1), ((0, 0), (1, 0), (0, 0)))
    return corner[:, None] + ways, -np.diff(falling, axis=1)


def _grid_places(space: fem.FunctionSpace, size: Sequence[float], cells: Sequence[int] | Numbers) -> Integers:
    """Grid coordinates of the vertices of a grid that this rank owns, (n, d)."""
    owned = nodes.points(space)[: space.dofmap.index_map.size_local]
    return np.rint(owned[:, : len(size)] * (np.array(cells) / np.array(size))).astype(np.int64)
