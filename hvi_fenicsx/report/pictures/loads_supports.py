"""What acts on the body's sides, from a result: loads and supports, on any shape or mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import HviError
from ...formula import Formula
from ...geometry import chains
from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..reader import Result
from .outline import normals
from .vtk_view import area_vectors


@dataclass(frozen=True)
class Side:
    """A piece of a boundary part: in the plane a line, in space all of it.

    Attributes:
        part: the part's name.
        vertices: (m,), in the plane along the line.
        facets: (k, 2) or (k, 3).
        normals: outward unit normals at the vertices, (m, 3).
    """

    part: str
    vertices: Integers
    facets: Integers
    normals: Array

    @property
    def normal(self) -> Array:
        """The mean outward normal (3,), of unit length; zero for a side that closes on itself."""
        mean = self.normals.mean(axis=0)
        return np.asarray(mean / (float(np.linalg.norm(mean)) or 1.0))


@dataclass(frozen=True)
class LoadedSide:
    """A side with a load.

    Attributes:
        side: the side.
        traction: at its vertices, N/m², (m, 3).
    """

    side: Side
    traction: Array


@dataclass(frozen=True)
class HeldSide:
    """A side whose normal displacement is prescribed.

    Attributes:
        side: the side.
        rolling: whether it is free along the side.
    """

    side: Side
    rolling: bool


def loaded_sides(result: Result) -> list[LoadedSide]:
    """The tractions that are not zero."""
    found = []
    for side, table in tables(result):
        traction = _traction(table.get("traction"), result.body.points[side.vertices])
        if traction is not None and np.any(traction):
            found.append(LoadedSide(side, traction))
    return found


def held_sides(result: Result) -> list[HeldSide]:
    """The sides that are held along the axis nearest to their normal."""
    found = []
    for side, table in tables(result):
        given = table.get("displacement")
        axis = int(np.argmax(np.abs(side.normal)))
        if isinstance(given, list) and len(given) == result.body.dimension and given[axis] != "free":
            found.append(HeldSide(side, any(v == "free" for i, v in enumerate(given) if i != axis)))
    return found


def tables(result: Result) -> Iterator[tuple[Side, Mapping[str, Any]]]:
    """The pieces of each boundary part, with what the scene says of it."""
    body = result.body
    for name, own in result.sides.items():
        table = (result.scene.get("boundary") or {}).get(name) or {}
        facets = body.oriented(own)
        for side in _lines(name, body, facets) if body.dimension == 2 else _faces(name, body, facets):
            yield side, table


def _lines(name: str, body: BodyMesh, facets: Integers) -> Iterator[Side]:
    for chain in chains(facets):
        edges = np.column_stack([chain[:-1], chain[1:]])
        outward = np.pad(normals(body.points, chain), ((0, 0), (0, 1)))
        yield Side(name, chain, edges, outward)


def _faces(name: str, body: BodyMesh, facets: Integers) -> Iterator[Side]:
    if not len(facets):
        return
    vertices, index = np.unique(facets, return_inverse=True)
    outward = np.zeros((len(vertices), 3))
    for corner in index.reshape(facets.shape).T:
        np.add.at(outward, corner, area_vectors(body.points, facets))
    yield Side(name, vertices, facets, outward / np.linalg.norm(outward, axis=1)[:, None])


def _traction(given: Any, points: Array) -> Array | None:
    """By component, a number or a formula; what cannot be read is not drawn."""
    if not isinstance(given, list):
        return None
    traction = np.zeros((len(points), 3))
    try:
        for i, component in enumerate(given[:3]):
            traction[:, i] = np.nan_to_num(Formula(component).at(points.astype(np.float64)))
    except HviError:
        return None
    return traction
