"""Where a picture draws a body: displaced, magnified, stretched where it is thin, or on its way off; and its sides.

What acts on its sides is read from a result, on any mesh: regions, loads and supports.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ...geometry import chains
from ...typing import Array, Integers, magnitude
from ..body_mesh import BodyMesh
from ..reader import Result
from ..solution_arrays import ContactPart, LoadArrays
from ..units import quantity, round_below, times

VISIBLE = 0.1
"""The largest displacement is drawn up to this part of the body's size, and the way of an escape three times as far."""
ARROW = 0.14
"""Part of the body's size: the longest arrow of a load, and the highest pressure."""
TINTS = ("#eef2f5", "#dbe3d3", "#e6dccb", "#d9d5e3", "#d3dfe6", "#e8d9d6")
"""The colours of regions: pale, since marks and names stand on them; with more regions they come again."""


@dataclass(frozen=True)
class DeformedBody:
    """A body with the displacement that it is drawn with.

    Attributes:
        body: the body at rest.
        displacement: of its vertices, m, (n, 3).
        factor: by which the displacement is magnified.
        stretch: by which the picture is stretched along each axis, (3,).
    """

    body: BodyMesh
    displacement: Array
    factor: float
    stretch: Array

    @cached_property
    def points(self) -> Array:
        """Where the vertices are drawn."""
        return (self.body.points + self.factor * self.displacement) * self.stretch

    @cached_property
    def at_rest(self) -> Array:
        """Where the vertices of the body at rest are drawn."""
        return self.body.points * self.stretch

    @property
    def as_drawn(self) -> BodyMesh:
        """The body at rest as it is drawn, with its escape mode drawn alike."""
        mode = self.body.escape_mode
        return replace(self.body, points=self.at_rest, escape_mode=None if mode is None else mode * self.stretch)

    @property
    def stretched(self) -> str:
        """How the picture is stretched, in words; empty where it is not."""
        names = zip(("width", "height", "depth"), self.stretch, strict=True)
        return "".join(f"{name} × {by:g}" for name, by in names if by != 1.0)

    @property
    def scales(self) -> str:
        """What is drawn larger than it is, in words."""
        return ", ".join(words for words in (times(self.factor), self.stretched) if words)


@dataclass(frozen=True)
class PartGeometry:
    """Where a contact part with m vertices lies on the body.

    Attributes:
        part: the part.
        facets: its facets in the body, looking outwards, (k, 2) or (k, 3).
        row: of each vertex of the body its row in the part's table, (n,); 0 off the part.
        obstacle: the unit vector (3,) towards a flat obstacle; None where the gap is along the part's normals.
        between_bodies: whether another body is what it meets, which is drawn itself.
    """

    part: ContactPart
    facets: Integers
    row: Integers
    obstacle: Array | None
    between_bodies: bool

    @property
    def pressure(self) -> Array:
        """-σ_n by vertex of the body, NaN where it is lifted and off the part."""
        values = np.full(len(self.row), np.nan)
        values[self.part.vertices] = np.where(self.part.idle, np.nan, self.part.pressure)
        return values


def part_geometries(result: Result) -> list[PartGeometry]:
    """Where all contact parts lie on the body."""
    body, found = result.body, []
    for part in result.parts:
        row = np.zeros(len(body.points), dtype=np.int64)
        row[part.vertices] = np.arange(len(part.vertices))
        obstacle, met = result.obstacle(part.name), result.between_bodies(part.name)
        found.append(PartGeometry(part, body.oriented(part.facets), row, obstacle, met))
    return found


def deform(body: BodyMesh, parts: Sequence[PartGeometry]) -> DeformedBody:
    """The body with a round factor that makes its displacement seen.

    Where a part leaves its obstacle by its own shape, as a disk does a floor, the factor is 1: magnified, displacements
    would push the body through the obstacle.

    Args:
        body: the body with its displacement.
        parts: its contact parts.
    """
    assert body.displacement is not None
    u, stretch = np.nan_to_num(body.displacement), _stretch(body)
    largest = magnitude(np.linalg.norm(u * stretch, axis=1))
    factor = max(1.0, round_below(VISIBLE * body.size / largest)) if largest > 0.0 else 1.0
    gap = max((float(np.nanmax(geometry.part["gap"], initial=0.0)) for geometry in parts), default=0.0)
    own_shape = factor * gap * stretch.max() > 3 * VISIBLE * body.size
    return DeformedBody(body, u, 1.0 if own_shape else factor, stretch)


def undeformed(body: BodyMesh) -> DeformedBody:
    """The body at rest; a thin one is stretched as its deformed body is."""
    return DeformedBody(body, np.zeros_like(body.points), 1.0, _stretch(body))


def _stretch(body: BodyMesh) -> Array:
    """By how much a picture is stretched along each axis, so that colours in a thin strip are seen, (3,)."""
    stretch, extents = np.ones(3), body.extents[: body.dimension]
    thin = int(np.argmin(extents))
    if body.dimension == 2 and extents[thin] > 0.0:
        stretch[thin] = max(1.0, round_below(ARROW / 2 * body.size / float(extents[thin])))
    return stretch


def escaping(body: BodyMesh) -> tuple[Array, Array]:
    """Where the escape mode brings the vertices, drawn large, (n, 3).

    Returns:
        These, and the ways there of a few vertices far out that move, (j, 2, 3).
    """
    mode = body.escape_mode
    assert mode is not None
    moved = body.points + 3 * VISIBLE * body.size / (magnitude(np.linalg.norm(mode, axis=1)) or 1.0) * mode
    far = body.outermost[sparse(body.points[body.outermost], body.size)]
    ways = np.stack([body.points[far], moved[far]], axis=1)
    lengths = np.linalg.norm(mode[far], axis=1)  # not the one that the body turns about
    return moved, ways[lengths > VISIBLE * lengths.max()]


def sparse(points: Array, spacing: float) -> Integers:
    """One point near each node of a coarse grid over all, by their numbers.

    Args:
        points: m, (m, d).
        spacing: of the grid, m, about.
    """
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    place = (points - low) * np.round(extent / spacing) / np.where(extent > 0.0, extent, 1.0)
    node = np.round(place)
    order = np.argsort(np.round(np.linalg.norm(place - node, axis=1), 6), kind="stable")
    return order[np.unique(node[order], axis=0, return_index=True)[1]]


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
        return self.normals.mean(axis=0)


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
        return magnitude(np.linalg.norm(self.traction, axis=1))

    @property
    def value(self) -> str:
        """How large it is, in words."""
        if self.total is None:
            return quantity(self.largest, "Pa")
        return quantity(self.total, "N/m" if self.side.facets.shape[1] == 2 else "N")


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
            measure = float(result.body.sizes(result.body.oriented(result.arrays.sides[side.part])).sum())
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
    for name, own in result.arrays.sides.items():
        facets = body.oriented(own)
        lines = [np.column_stack([c[:-1], c[1:]]) for c in chains(facets)] if body.dimension == 2 else [facets]
        for piece in (line for line in lines if len(line)):  # a line in the order of its edges
            vertices = np.append(piece[:, 0], piece[-1, 1]) if body.dimension == 2 else np.unique(piece)
            yield Side(name, vertices, piece, body.normals(piece)[vertices]), result.roles(name)


def _traction(load: LoadArrays | None, side: Side) -> Array:
    """A load at the vertices of a side, N/m², (m, 3)."""
    traction = np.zeros((len(side.vertices), 3))
    if load is not None:
        at = np.flatnonzero(np.isin(side.vertices, load.vertices))
        own = np.searchsorted(load.vertices, side.vertices[at])
        traction[at, : load.traction.shape[1]] = load.traction[own]
        traction[at] -= load.pressure[own, None] * side.normals[at]
    return np.nan_to_num(traction)
