"""The body as dolfinx writes it for ParaView: ``.pvd``, its ``.pvtu`` and the ranks' ``.vtu`` pieces, read by NumPy.

VTK is not asked: dolfinx writes Lagrange cells, which VTK subdivides when it takes their surface, and a plane picture
needs no VTK at all.
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from ..typing import Array, Integers, Mask
from .pictures.draw import PictureError

AT_ONCE = 2_000_000
"""Pairs of points whose distances are simply all computed."""
CELL_FIELDS = ("von_mises",)
"""What is read of the cells' fields: only what a picture shows."""
_CORNERS = {5: 3, 69: 3, 10: 4, 71: 4}
"""Vertices of VTK's triangles and tetrahedra, plain and Lagrange."""


@dataclass(frozen=True)
class Body:
    """A mesh of triangles or tetrahedra.

    Attributes:
        points: (n, 3), m. cells: (m, 3|4). fields: vector fields at the points by name, (n, 3).
        by_cell: numbers of the cells by name, (m,).
    """

    points: Array
    cells: Integers
    fields: Mapping[str, Array]
    by_cell: Mapping[str, Array] = field(default_factory=dict)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return int(self.cells.shape[1]) - 1

    @cached_property
    def size(self) -> float:
        """The largest extent, m."""
        return float(np.max(np.ptp(self.points, axis=0)))

    @property
    def boundary(self) -> Integers:
        """Facets of one cell only (k, 2|3); counterclockwise seen from outside, in the plane the body on their left."""
        return self._skin[0]

    @property
    def behind(self) -> Integers:
        """The cell of each facet of the boundary, (k,)."""
        return self._skin[1]

    @cached_property
    def _skin(self) -> tuple[Integers, Integers]:
        d = self.dimension
        facets = np.concatenate([np.delete(self.cells, i, axis=1) for i in range(d + 1)])
        _, first, count = np.unique(_keys(facets, len(self.points)), return_index=True, return_counts=True)
        lone = np.sort(first[count == 1])
        opposite = self.cells.T.ravel()[lone]
        return _outward(self.points, facets[lone], opposite), lone % len(self.cells)

    def moving(self, name: str) -> Body:
        """The body that a rigid motion moves, one of several: it leaves a point or an axis at rest, but no cell."""
        moves = np.any(self.fields[name] != 0.0, axis=1)
        cells = self.cells[np.any(moves[self.cells], axis=1)]
        kept, numbered = np.unique(cells, return_inverse=True)
        fields = {name: values[kept] for name, values in self.fields.items()}
        return Body(self.points[kept], numbered.reshape(cells.shape), fields)

    def vertices(self, points: Array) -> Integers:
        """The body's vertices at given points (m, 3).

        Raises:
            PictureError: there is none within rounding at one of them.
        """
        candidates = np.unique(self.boundary)
        distance, nearest = _nearest(self.points[candidates], points)
        if np.max(distance, initial=0.0) > 1e-6 * self.size:
            raise PictureError("contact.csv and displacement.pvd do not belong together: a vertex is not on the body")
        return np.asarray(candidates[nearest])

    def facets_of(self, vertices: Integers) -> Integers:
        """The boundary facets all of whose corners are among the vertices."""
        return np.asarray(self.boundary[self.among(vertices)])

    def among(self, vertices: Integers) -> Mask:
        """Which facets of the boundary these are, (k,)."""
        chosen = np.zeros(len(self.points), dtype=bool)
        chosen[vertices] = True
        return np.asarray(chosen[self.boundary].all(axis=1))


def _nearest(candidates: Array, points: Array) -> tuple[Array, Integers]:
    """How far the nearest candidate is from each point, and which it is."""
    if len(candidates) * len(points) <= AT_ONCE:
        squares = np.sum((points[:, None] - candidates[None]) ** 2, axis=2)
        return np.sqrt(squares.min(axis=1)), squares.argmin(axis=1)
    from scipy.spatial import cKDTree  # to load it takes as long as a small picture

    distance, nearest = cKDTree(candidates).query(points)
    return distance, nearest


def _outward(points: Array, facets: Integers, opposite: Integers) -> Integers:
    """Facets turned so that the opposite corner of their cell is behind them."""
    corner = points[facets[:, 0]]
    sides = [points[facets[:, i]] - corner for i in range(1, facets.shape[1])]
    if len(sides) == 1:  # the way out of the page makes a triangle of an edge
        sides.append(np.broadcast_to([0.0, 0.0, 1.0], corner.shape))
    inward = np.einsum("ki,ki->k", np.cross(sides[0], sides[1]), points[opposite] - corner) > 0.0
    return np.where(inward[:, None], facets[:, ::-1], facets)


def _keys(facets: Integers, count: int) -> Integers:
    """One number for each set of corners."""
    ordered = np.sort(facets, axis=1)
    key = ordered[:, 0]
    for column in ordered.T[1:]:
        key = key * count + column
    return key


def read_body(path: Path) -> Body:
    """The body of a ``.pvd`` file, at its last step.

    Raises:
        PictureError: a file is missing, damaged, or holds other cells.
    """
    try:
        return _joined([_piece(path.parent / name) for name in _pieces(path)])
    except OSError as error:
        raise PictureError(f"{error.filename}: {error.strerror}") from None
    except (ElementTree.ParseError, ValueError, KeyError, AttributeError) as error:
        raise PictureError(f"{path}: damaged, or not written by dolfinx ({error})") from None


def _pieces(path: Path) -> list[str]:
    steps = list(ElementTree.parse(path).getroot().iter("DataSet"))
    last = [step.attrib["file"] for step in steps if step.attrib["timestep"] == steps[-1].attrib["timestep"]]
    files = []
    for name in last:
        whole = name.endswith(".vtu")
        files += [name] if whole else [p.attrib["Source"] for p in ElementTree.parse(path.parent / name).iter("Piece")]
    return files


def _piece(path: Path) -> tuple[Integers, Body]:
    """A rank's own cells, and the mesh-wide numbers of its points."""
    piece = ElementTree.parse(path).getroot().find("UnstructuredGrid/Piece")
    if piece is None:
        raise ValueError(f"{path.name} has no mesh")
    points = _array(piece.find("Points/DataArray")).reshape(-1, 3)
    kind = _array(piece.find("Cells/DataArray[@Name='types']"))
    corners = {_CORNERS.get(int(k), 0) for k in np.unique(kind)} or {0}
    if 0 in corners or len(corners) > 1:
        raise ValueError("pictures draw triangles or tetrahedra")
    cells = _array(piece.find("Cells/DataArray[@Name='connectivity']")).astype(np.int64).reshape(len(kind), -1)
    ghost = piece.find("CellData/DataArray[@Name='vtkGhostType']")
    owned = slice(None) if ghost is None else _array(ghost) == 0
    number = piece.find("PointData/DataArray[@Name='vtkOriginalPointIds']")
    numbers = np.arange(len(points)) if number is None else _array(number).astype(np.int64)
    by_cell = {name: values[owned] for name, values in _numbers(piece).items()}
    return numbers, Body(points, cells[owned, : corners.pop()], _fields(piece), by_cell)


def _fields(piece: ElementTree.Element) -> dict[str, Array]:
    found = piece.iterfind("PointData/DataArray[@NumberOfComponents='3']")
    return {array.attrib["Name"]: _array(array).reshape(-1, 3) for array in found}


def _numbers(piece: ElementTree.Element) -> dict[str, Array]:
    found = {array.attrib["Name"]: array for array in piece.iterfind("CellData/DataArray")}
    return {name: _array(found[name]) for name in CELL_FIELDS if name in found}


def _array(element: ElementTree.Element | None) -> Array:
    if element is None:
        raise ValueError("an array is missing")
    if element.attrib.get("format", "ascii") != "ascii":
        raise ValueError("arrays are expected as text")
    return np.fromstring(element.text or "", sep=" ")


def _joined(pieces: Sequence[tuple[Integers, Body]]) -> Body:
    """One mesh of the ranks' pieces: a vertex that several of them know is one vertex."""
    if len(pieces) == 1:
        return pieces[0][1]
    starts = np.cumsum([0, *(len(body.points) for _, body in pieces)])
    _, first, index = np.unique(
        np.concatenate([numbers for numbers, _ in pieces]), return_index=True, return_inverse=True
    )
    cells = np.concatenate([index[body.cells + start] for (_, body), start in zip(pieces, starts, strict=False)])
    names = pieces[0][1].fields
    fields = {name: np.concatenate([body.fields[name] for _, body in pieces])[first] for name in names}
    by_cell = {name: np.concatenate([body.by_cell[name] for _, body in pieces]) for name in pieces[0][1].by_cell}
    return Body(np.concatenate([body.points for _, body in pieces])[first], cells, fields, by_cell)
