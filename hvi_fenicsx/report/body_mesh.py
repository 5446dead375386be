"""The body of a result as a mesh: its boundary, which looks outwards, and its fields."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..geometry import chains, in_space
from ..typing import Array, Integers
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
        return np.ptp(self.points[self.outermost], axis=0)

    @property
    def size(self) -> float:
        """The largest extent, m."""
        return float(np.max(self.extents))

    @cached_property
    def volumes(self) -> Array:
        """Area (m²) or volume (m³) of each cell, (c,)."""
        if self.dimension == 2:
            return self.sizes(self.cells)
        first, *others = (self.points[corner] for corner in self.cells.T)
        return np.abs(np.linalg.det(np.stack([other - first for other in others], axis=1))) / 6

    @property
    def boundary(self) -> Integers:
        """Facets of one cell only (k, 2|3); counterclockwise seen from outside, in the plane the body on their left."""
        return self._skin[0]

    @property
    def behind(self) -> Integers:
        """The cell of each facet of the boundary, (k,)."""
        return self._skin[1]

    @cached_property
    def outline(self) -> list[Integers]:
        """The closed chains of the boundary of a plane body, by their vertices."""
        return chains(self.boundary)

    @cached_property
    def outermost(self) -> Integers:
        """The vertices of the boundary, ascending, (m,): what a picture shows lies between them."""
        return np.unique(self.boundary)

    @cached_property
    def _skin(self) -> tuple[Integers, Integers]:
        d = self.dimension
        facets = np.concatenate([np.delete(self.cells, i, axis=1) for i in range(d + 1)])
        _, first, count = np.unique(self._keys(facets), return_index=True, return_counts=True)
        alone = np.sort(first[count == 1])
        inner = self.points[self.cells.T.ravel()[alone]] - self.points[facets[alone, 0]]
        inward = np.einsum("ki,ki->k", self.area_vectors(facets[alone]), inner) > 0.0
        return np.where(inward[:, None], facets[alone, ::-1], facets[alone]), alone % len(self.cells)

    def area_vectors(self, facets: Integers) -> Array:
        """The normals (k, 3) of facets, as long as their lengths or areas; to the right of an edge in the plane."""
        first, *others = (self.points[corner] for corner in facets.T)
        if len(others) == 1:
            return np.cross(others[0] - first, [0.0, 0.0, 1.0])
        return np.cross(others[0] - first, others[1] - first) / 2

    def sizes(self, facets: Integers) -> Array:
        """The length or the area of facets, m or m², (k,)."""
        return np.linalg.norm(self.area_vectors(facets), axis=1)

    def normals(self, facets: Integers) -> Array:
        """Outward unit normals at the vertices of facets of the boundary; zero at others, (n, 3)."""
        summed, vectors = np.zeros(self.points.shape), self.area_vectors(facets)
        for corner in facets.T:
            np.add.at(summed, corner, vectors)
        return summed / np.maximum(np.linalg.norm(summed, axis=1), np.finfo(float).tiny)[:, None]

    def oriented(self, facets: Integers) -> Integers:
        """These facets (j, 2|3) as they are in the boundary; those inside of the body are left out."""
        return self.boundary[np.isin(self._keys(self.boundary), self._keys(facets))]

    def _keys(self, facets: Integers) -> Integers:
        """One number for each set of corners, (k,)."""
        key = np.zeros(len(facets), dtype=np.int64)
        for column in np.sort(facets, axis=1).T:
            key = key * len(self.points) + column
        return key

    def moving(self) -> BodyMesh:
        """The body that the escape mode moves, one of several: it leaves a point or an axis at rest, but no cell."""
        assert self.escape_mode is not None
        moves = np.any(self.escape_mode != 0.0, axis=1)
        return replace(self, cells=self.cells[np.any(moves[self.cells], axis=1)])


def body_mesh(arrays: SolutionArrays) -> BodyMesh:
    """The body of a solution."""
    fields = (arrays.displacement, arrays.escape_mode)
    displacement, escape_mode = (None if field is None else in_space(field) for field in fields)
    return BodyMesh(
        points=in_space(arrays.points),
        cells=arrays.cells,
        displacement=displacement,
        escape_mode=escape_mode,
        von_mises=None if arrays.von_mises is None else arrays.von_mises.astype(np.float64),
    )
