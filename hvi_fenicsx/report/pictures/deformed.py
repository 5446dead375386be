"""The deformed body, magnified, and what acts on its contact parts, as points: the same in the plane and in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..contact_part import ContactPart
from ..reader import Result
from ..units import round_below, times

VISIBLE = 0.08
"""How large the largest displacement is drawn, of the body's size."""
NEAR = 0.3
"""Gaps larger than this, magnified, of the body's size, are the body's own shape."""
KEPT = 0.75
"""A small body beside a large one is drawn with this part of its area or volume, at least."""
THIN, DRAWN = 1 / 40, 1 / 15
"""A plane body whose height is a smaller part of its length is drawn higher (or wider), up to the second part."""


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
    stretch: Array = field(default_factory=lambda: np.ones(3))

    @cached_property
    def points(self) -> Array:
        """Where the vertices are drawn."""
        return np.asarray((self.body.points + self.factor * self.displacement) * self.stretch)

    @cached_property
    def at_rest(self) -> Array:
        """Where the vertices of the body at rest are drawn."""
        return np.asarray(self.body.points * self.stretch)

    @property
    def as_drawn(self) -> BodyMesh:
        """The body at rest as it is drawn, with its escape mode drawn alike."""
        if not self.stretched:
            return self.body  # which knows its boundary already
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

    @cached_property
    def amount(self) -> Array:
        """|u|, m."""
        return np.asarray(np.linalg.norm(self.displacement, axis=1))


@dataclass(frozen=True)
class PartGeometry:
    """Where a contact part with m vertices lies on the body.

    Attributes:
        part: the part.
        vertices: its vertices in the body, (m,).
        facets: its facets in the body, looking outwards, (k, 2) or (k, 3).
        row: of each vertex of the body its row in the part's table, (n,); 0 off the part.
        obstacle: the unit vector (3,) towards a flat obstacle; None where the gap is along the part's normals.
        between_bodies: whether another body is what it meets, which is drawn itself.
    """

    part: ContactPart
    vertices: Integers
    facets: Integers
    row: Integers
    obstacle: Array | None
    between_bodies: bool = False

    def values(self, column: Array, vertices: Integers) -> Array:
        """A column of the table at some vertices.

        Args:
            column: by row of the table, (m,).
            vertices: vertices of the body, (j,).
        """
        return np.asarray(column[self.row[vertices]])


def part_geometries(result: Result) -> list[PartGeometry]:
    """Where all contact parts lie on the body."""
    body, found = result.body, []
    for part in result.parts:
        row = np.zeros(len(body.points), dtype=np.int64)
        row[part.vertices] = np.arange(len(part.vertices))
        facets = body.oriented(part.facets)
        obstacle, met = result.obstacle(part.name), result.between_bodies(part.name)
        found.append(PartGeometry(part, part.vertices, facets, row, obstacle, met))
    return found


def deform(body: BodyMesh, parts: Sequence[PartGeometry]) -> DeformedBody:
    """The body with a round factor that makes its displacement seen, and crushes none of its pieces.

    Where a part leaves its obstacle by its own shape, as a disk does a floor, the factor is 1: magnified, displacements
    would push the body through the obstacle.

    Args:
        body: the body with its displacement.
        parts: its contact parts.
    """
    assert body.displacement is not None
    u, stretch = np.nan_to_num(body.displacement), _stretch(body)
    largest = float(np.linalg.norm(u * stretch, axis=1).max(initial=0.0))
    if largest == 0.0:
        return DeformedBody(body, u, 1.0, stretch)
    factor = 1.0 if largest > 0.5 * VISIBLE * body.size else round_below(VISIBLE * body.size / largest * 1.25)
    while factor > 1.0 and body.kept(body.points + factor * u).min() < KEPT:
        factor = round_below(factor / 1.5)
    gap = max((float(np.nanmax(geometry.part["gap"], initial=0.0)) for geometry in parts), default=0.0)
    return DeformedBody(body, u, factor if factor * gap * stretch.max() < NEAR * body.size else 1.0, stretch)


def undeformed(body: BodyMesh) -> DeformedBody:
    """The body at rest; a thin one is stretched as its deformed body is."""
    return DeformedBody(body, np.zeros_like(body.points), 1.0, _stretch(body))


def _stretch(body: BodyMesh) -> Array:
    """By how much a picture is stretched along each axis, so that colours in a thin strip are seen, (3,)."""
    stretch, extents = np.ones(3), body.extents[: body.dimension]
    thin = int(np.argmin(extents))
    if body.dimension == 2 and 0.0 < extents[thin] < THIN * body.size:
        stretch[thin] = max(1.0, round_below(DRAWN * body.size / float(extents[thin])))
    return stretch


def largest_stress(parts: list[PartGeometry]) -> float:
    """The largest |σ_n| on any of them, N/m²."""
    return max((float(np.nanmax(np.abs(f.part.pressure), initial=0.0)) for f in parts), default=0.0)
