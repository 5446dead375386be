"""What a body is made of and what acts on its sides, from a result: regions, loads and supports, on any mesh."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...geometry import chains
from ...typing import Array, Integers, Mask
from ..body_mesh import BodyMesh
from ..reader import Result
from ..solution_arrays import LoadArrays
from ..units import quantity

SHEAR = 0.2
"""A load is along its side where the part across it is smaller than this part of it."""


TINTS = ("#eef2f5", "#dbe3d3", "#e6dccb", "#d9d5e3", "#d3dfe6", "#e8d9d6")
"""The colours of regions: pale, since marks and names stand on them; with more regions they come again."""


@dataclass(frozen=True)
class Region:
    """A region of the body.

    Attributes:
        name: its name.
        cells: its cells, (k,).
        tint: its colour.
    """

    name: str
    cells: Integers
    tint: str


def regions(result: Result) -> list[Region]:
    """The regions with cells, the largest first, so that one is drawn on what it is a part of; cells of none lead."""
    named = sorted(result.arrays.regions.items(), key=lambda region: -len(region[1]))
    cells = [np.arange(len(result.body.cells)), *(own for _, own in named)]
    others = np.setdiff1d(cells[0], np.concatenate(cells[1:] or cells))
    found = [("no named region", others), *named]
    shown = [(name, own) for name, own in found if len(own)]
    return [Region(name, own, TINTS[place % len(TINTS)]) for place, (name, own) in enumerate(shown)]


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
        """The mean outward normal (3,): short for a side that closes on itself, as a hole's does."""
        return np.asarray(self.normals.mean(axis=0))


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


@dataclass(frozen=True)
class HeldSide:
    """A side whose normal displacement is prescribed.

    Attributes:
        side: the side.
        rolling: whether it is free along the side.
    """

    side: Side
    rolling: bool


def touches(roles: Iterable[Mapping[str, Any]]) -> bool:
    """Whether contact or a law acts on a part, from the roles of its effects."""
    return any(role["bounded"] or role["laws"] for role in roles)


def loaded_sides(result: Result, factor: float = 1.0) -> list[LoadedSide]:
    """The tractions that are not zero, and the forces that are spread over their parts.

    Args:
        result: the result.
        factor: by which they are multiplied.
    """
    found, forces = [], {part: np.array([*value, 0.0][:3]) for part, key, value in result.driven if key == "force"}
    for side, _ in roles_by_side(result):
        traction = _traction(result.arrays.loads.get(side.part), side)
        if np.any(traction):
            found.append(LoadedSide(side, factor * traction))
        if np.any(force := forces.get(side.part, np.zeros(3))):
            measure = float(result.body.sizes(result.body.oriented(result.sides[side.part])).sum())
            spread = np.broadcast_to(factor * force / measure, side.normals.shape)
            found.append(LoadedSide(side, spread, factor * float(np.linalg.norm(force))))
    return found


def held_sides(result: Result) -> list[HeldSide]:
    """The sides that are held along the axis nearest to their normal."""
    found = []
    for side, roles in roles_by_side(result):
        held = {component for role in roles for component in role["prescribed"]}
        if int(np.argmax(np.abs(side.normal))) in held:
            found.append(HeldSide(side, rolling=len(held) < result.body.dimension))
    return found


def roles_by_side(result: Result) -> Iterator[tuple[Side, Sequence[Mapping[str, Any]]]]:
    """The pieces of each boundary part, with the roles of its effects."""
    body = result.body
    for name, own in result.sides.items():
        facets = body.oriented(own)
        lines = [np.column_stack([c[:-1], c[1:]]) for c in chains(facets)] if body.dimension == 2 else [facets]
        for piece in lines:
            if len(piece):
                yield _side(name, body, piece), result.roles(name)


def _side(name: str, body: BodyMesh, facets: Integers) -> Side:
    """A line in the order of its edges, or a face with its vertices ascending."""
    vertices = np.append(facets[:, 0], facets[-1, 1]) if body.dimension == 2 else np.unique(facets)
    return Side(name, vertices, facets, body.normals(facets)[vertices])


def _traction(load: LoadArrays | None, side: Side) -> Array:
    """A load at the vertices of a side, N/m², (m, 3)."""
    traction = np.zeros((len(side.vertices), 3))
    if load is not None:
        at = np.flatnonzero(np.isin(side.vertices, load.vertices))
        own = np.searchsorted(load.vertices, side.vertices[at])
        traction[at, : load.traction.shape[1]] = load.traction[own]
        traction[at] -= load.pressure[own, None] * side.normals[at]
    return np.asarray(np.nan_to_num(traction))
