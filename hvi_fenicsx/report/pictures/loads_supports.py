"""What acts on the body's sides, from a result: loads and supports, on any shape or mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import HviError
from ...formula import Formula
from ...geometry import chains
from ...typing import Array, Integers, Mask
from ..body_mesh import BodyMesh
from ..reader import Result
from ..solution_arrays import LoadArrays
from ..units import quantity
from .outline import normals
from .vtk_view import area_vectors

SHEAR = 0.2
"""A load is along its side where the part across it is smaller than this part of it."""
CLOSED = 0.1
"""Length of the mean of a side's unit normals below which it closes on itself."""


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
        """The mean outward normal (3,), of unit length; zero for a side that closes on itself, as a hole's does."""
        mean = self.normals.mean(axis=0)
        length = float(np.linalg.norm(mean))
        return np.asarray(mean / length if length > CLOSED else np.zeros_like(mean))


@dataclass(frozen=True)
class LoadedSide:
    """A side with a load.

    Attributes:
        side: the side.
        traction: at its vertices, N/m², (m, 3).
        total: the size of the force that is spread over the part, N, in the plane N/m; None of a load by area.
    """

    side: Side
    traction: Array
    total: float | None = None

    @property
    def largest(self) -> float:
        """The largest traction, N/m²."""
        return float(np.linalg.norm(self.traction, axis=1).max())

    @property
    def value(self) -> str:
        """How large it is, in words."""
        if self.total is None:
            return quantity(self.largest, "Pa")
        return quantity(self.total, "N/m" if self.side.facets.shape[1] == 2 else "N")

    @property
    def sheared(self) -> Mask:
        """Where the load is along the side, so that an arrow to it would lie on it, (m,)."""
        across = np.abs(np.einsum("ki,ki->k", self.traction, self.side.normals))
        return np.asarray(across <= SHEAR * np.linalg.norm(self.traction, axis=1))

    def times(self, factor: float) -> LoadedSide:
        """A multiple of the load."""
        return replace(self, traction=factor * self.traction, total=None if self.total is None else factor * self.total)


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
    """The tractions that are not zero, and the forces that are spread over their parts."""
    found, forces = [], {part: _components(value) for part, key, value in result.driven if key == "force"}
    for side, roles in roles_by_side(result):
        traction = np.sum([_traction(role, result.body.points[side.vertices], side.normals) for role in roles], axis=0)
        traction = traction + _given(result.arrays.loads.get(side.part), side)
        if np.any(traction):
            found.append(LoadedSide(side, traction))
        if np.any(force := forces.get(side.part, np.zeros(3))):
            spread = np.broadcast_to(force / _measure(result, side.part), side.normals.shape)
            found.append(LoadedSide(side, spread, float(np.linalg.norm(force))))
    return found


def _components(force: Sequence[float]) -> Array:
    return np.array([*force, 0.0][:3], dtype=np.float64)


def _measure(result: Result, part: str) -> float:
    """The length or the area of a boundary part, m or m²."""
    facets, points = result.body.oriented(result.sides[part]), result.body.points
    if facets.shape[1] == 2:
        return float(np.linalg.norm(points[facets[:, 1]] - points[facets[:, 0]], axis=1).sum())
    return float(np.linalg.norm(area_vectors(points, facets), axis=1).sum())


def borne_loads(result: Result) -> list[LoadedSide]:
    """The tractions under which the state that is shown is in equilibrium: the scene's, or the part that is borne."""
    factor = 1.0 if result.last_borne is None else float(result.last_borne["factor"])
    return [load.times(factor) for load in loaded_sides(result)]


def held_sides(result: Result) -> list[HeldSide]:
    """The sides that are held along the axis nearest to their normal."""
    found = []
    for side, roles in roles_by_side(result):
        held = {component for role in roles for component in role["prescribed"]}
        axis = int(np.argmax(np.abs(side.normal)))
        if axis in held:
            found.append(HeldSide(side, rolling=len(held) < result.body.dimension))
    return found


def roles_by_side(result: Result) -> Iterator[tuple[Side, Sequence[Mapping[str, Any]]]]:
    """The pieces of each boundary part, with the roles of its effects."""
    body = result.body
    for name, own in result.sides.items():
        roles = result.roles(name)
        facets = body.oriented(own)
        for side in _lines(name, body, facets) if body.dimension == 2 else _faces(name, body, facets):
            yield side, roles


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


def _given(load: LoadArrays | None, side: Side) -> Array:
    """A load that the result has at vertices, N/m², (m, 3); it is zero at vertices that it does not have."""
    traction = np.zeros((len(side.vertices), 3))
    if load is not None:
        at = np.flatnonzero(np.isin(side.vertices, load.vertices))
        own = np.searchsorted(load.vertices, side.vertices[at])
        traction[at, : load.traction.shape[1]] = load.traction[own]
        traction[at] -= load.pressure[own, None] * side.normals[at]
    return np.asarray(np.nan_to_num(traction))


def _traction(role: Mapping[str, Any], points: Array, normals: Array) -> Array:
    """The load of one effect at points (m, 3), N/m², (m, 3); what cannot be read is not drawn."""
    traction = np.zeros((len(points), 3))
    try:
        for i, component in enumerate(role["traction"][:3]):
            traction[:, i] = _values(component, points)
        if role["pressure"] is not None:
            traction -= _values(role["pressure"], points)[:, None] * normals
    except HviError:
        return np.zeros((len(points), 3))
    return traction


def _values(formula: float | str, points: Array) -> Array:
    return np.nan_to_num(Formula(formula).at(points.astype(np.float64)))
