"""The body of a result as a mesh: its boundary, which looks outwards, and its fields."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..geometry import chains
from ..typing import Array, Integers, Mask
from .solution_arrays import SolutionArrays


@dataclass(frozen=True, kw_only=True)
class BodyMesh:
    """A mesh of c triangles or tetrahedra with n vertices, which stand in space in both cases.

    Attributes:
        points: the vertices, m, (n, 3).
        cells: the vertices of each cell, (c, 3) or (c, 4).
        displacement: m, (n, 3); None where nothing was solved.
        escape_mode: the rigid motion along which the body escapes, (n, 3); None where it does not.
        von_mises: the von Mises stress of each cell, N/m², (c,); None where it was not computed.
    """

    points: Array
    cells: Integers
    displacement: Array | None = None
    escape_mode: Array | None = None
    von_mises: Array | None = None

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.cells.shape[1]) - 1

    @cached_property
    def extents(self) -> Array:
        """How far the body reaches along each axis, m, (3,)."""
        return np.asarray(np.ptp(self.points[self.outermost], axis=0))

    @property
    def size(self) -> float:
        """The largest extent, m."""
        return float(np.max(self.extents))

    @cached_property
    def volumes(self) -> Array:
        """Area (m²) or volume (m³) of each cell, (c,)."""
        return np.abs(self._signed)

    @cached_property
    def _signed(self) -> Array:
        return self.signed_volumes(self.points)

    def kept(self, points: Array) -> Array:
        """The part of its area or volume that each piece keeps where its vertices are elsewhere.

        Args:
            points: where they are, m, (n, 3).
        """
        moved = np.sign(self._signed) * self.signed_volumes(points)
        return np.asarray(np.bincount(self.pieces, moved) / np.bincount(self.pieces, self.volumes))

    def signed_volumes(self, points: Array) -> Array:
        """Area (m²) or volume (m³) of each cell, (c,); it changes its sign where a cell is turned inside out.

        Args:
            points: where the vertices are, m, (n, 3).
        """
        first, *others = self.cells.T
        d = self.dimension
        sides = [[points[:, i][other] - points[:, i][first] for i in range(d)] for other in others]
        if d == 2:
            (a, b), (c, e) = sides
            return np.asarray((a * e - b * c) / 2)
        return np.asarray(np.sum(np.cross(sides[0], sides[1], axis=0) * sides[2], axis=0) / 6)

    @cached_property
    def pieces(self) -> Integers:
        """The number of the piece that each cell is in, (c,): pieces share no vertex."""
        if self._has_one_surface():
            return np.zeros(len(self.cells), dtype=np.int64)
        return _joined(self.cells)[self.cells[:, 0]]

    def _has_one_surface(self) -> bool:
        """Whether all of the boundary hangs together; then so does the body, and nobody need ask its cells."""
        if self.dimension == 2:
            return len(self.outline) == 1
        return len(np.unique(_joined(self.boundary)[self.outermost])) == 1

    @property
    def boundary(self) -> Integers:
        """Facets of one cell only (k, 2|3); counterclockwise seen from outside, in the plane the body on their left."""
        return self._skin[0]

    @cached_property
    def outline(self) -> list[Integers]:
        """The closed chains of the boundary of a plane body, by their vertices."""
        return chains(self.boundary)

    @cached_property
    def outermost(self) -> Integers:
        """The vertices of the boundary, ascending, (m,): what a picture shows lies between them."""
        return np.unique(self.boundary)

    @property
    def behind(self) -> Integers:
        """The cell of each facet of the boundary, (k,)."""
        return self._skin[1]

    @cached_property
    def _skin(self) -> tuple[Integers, Integers]:
        d = self.dimension
        facets = np.concatenate([np.delete(self.cells, i, axis=1) for i in range(d + 1)])
        alone = _alone(_keys(facets, len(self.points)))
        opposite = self.cells.T.ravel()[alone]
        return _outward(self.points, facets[alone], opposite), alone % len(self.cells)

    def among(self, facets: Integers) -> Mask:
        """Which facets of the boundary are among these facets (j, 2|3), whatever the order of their vertices; (k,)."""
        count = len(self.points)
        return np.asarray(np.isin(_keys(self.boundary, count), _keys(facets, count)))

    def oriented(self, facets: Integers) -> Integers:
        """These facets (j, 2|3) as they are in the boundary; those inside of the body are left out."""
        return np.asarray(self.boundary[self.among(facets)])

    def moving(self) -> BodyMesh:
        """The body that the escape mode moves, one of several: it leaves a point or an axis at rest, but no cell."""
        assert self.escape_mode is not None
        moves = np.any(self.escape_mode != 0.0, axis=1)
        cells = self.cells[np.any(moves[self.cells], axis=1)]
        kept, numbered = np.unique(cells, return_inverse=True)
        return BodyMesh(
            points=self.points[kept], cells=numbered.reshape(cells.shape), escape_mode=self.escape_mode[kept]
        )


def body_mesh(arrays: SolutionArrays) -> BodyMesh:
    """The body of a solution."""
    return BodyMesh(
        points=_in_space(arrays.points),
        cells=arrays.cells,
        displacement=None if arrays.displacement is None else _in_space(arrays.displacement),
        escape_mode=None if arrays.escape_mode is None else _in_space(arrays.escape_mode),
        von_mises=None if arrays.von_mises is None else arrays.von_mises.astype(np.float64),
    )


def _joined(simplices: Integers) -> Integers:
    """The number of what each vertex hangs together with by edges, triangles or cells (k, 2|3|4), (n,)."""
    from scipy.sparse import coo_array  # a tenth of a second, which most plane bodies need not wait for
    from scipy.sparse.csgraph import connected_components

    first, *others = simplices.T
    ends = np.tile(first, len(others)), np.concatenate(others)
    graph = coo_array((np.ones(len(ends[0]), dtype=np.int8), ends), shape=(int(simplices.max()) + 1,) * 2)
    return np.asarray(connected_components(graph, directed=False)[1])


def _in_space(vectors: Array) -> Array:
    """Vectors (n, d) with zeros for what they lack of three components."""
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def _outward(points: Array, facets: Integers, opposite: Integers) -> Integers:
    """Facets turned so that the opposite corner of their cell is behind them."""
    corner = points[facets[:, 0]]
    sides = [points[facets[:, i]] - corner for i in range(1, facets.shape[1])]
    if len(sides) == 1:  # the way out of the page makes a triangle of an edge
        sides.append(np.broadcast_to([0.0, 0.0, 1.0], corner.shape))
    inward = np.einsum("ki,ki->k", np.cross(sides[0], sides[1]), points[opposite] - corner) > 0.0
    return np.where(inward[:, None], facets[:, ::-1], facets)


def _alone(keys: Integers) -> Integers:
    """The places of the keys that no other equals, ascending; found by value, since argsort takes twice as long."""
    ordered = np.sort(keys)
    differs = np.ones(len(keys) + 1, dtype=np.bool_)
    differs[1:-1] = ordered[1:] != ordered[:-1]
    single = ordered[differs[1:] & differs[:-1]]
    near = np.minimum(np.searchsorted(single, keys), len(single) - 1)
    return np.flatnonzero(single[near] == keys)


def _keys(facets: Integers, count: int) -> Integers:
    """One number for each set of corners, (k,); by columns, since numpy sorts many short rows slowly."""
    columns = [facets[:, i] for i in range(facets.shape[1])]
    for last in range(len(columns) - 1, 0, -1):
        for i in range(last):
            columns[i], columns[i + 1] = np.minimum(*columns[i : i + 2]), np.maximum(*columns[i : i + 2])
    key = columns[0]
    for column in columns[1:]:
        key = key * count + column
    return key
