"""The deformed body, magnified, and what acts on its contact parts, as points: the same in the plane and in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..reader import ContactPart, Result
from ..units import round_below

VISIBLE = 0.08
"""How large the largest displacement is drawn, of the body's size."""
NEAR = 0.3
"""Gaps larger than this, magnified, of the body's size, are the body's own shape."""


@dataclass(frozen=True)
class DeformedBody:
    """A body with the displacement that it is drawn with.

    Attributes:
        body: the body at rest.
        displacement: of its vertices, m, (n, 3).
        factor: by which the displacement is magnified.
    """

    body: BodyMesh
    displacement: Array
    factor: float

    @cached_property
    def points(self) -> Array:
        """Where the vertices are drawn."""
        return self.body.points + self.factor * self.displacement

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
    """The body with a round factor that makes its displacement seen.

    Where a part leaves its obstacle by its own shape, as a disk does a floor, the factor is 1: magnified, displacements
    would push the body through the obstacle.

    Args:
        body: the body with its displacement.
        parts: its contact parts.
    """
    assert body.displacement is not None
    u = np.nan_to_num(body.displacement)
    largest = float(np.linalg.norm(u, axis=1).max(initial=0.0))
    if largest == 0.0:
        return DeformedBody(body, u, 1.0)
    factor = 1.0 if largest > 0.5 * VISIBLE * body.size else round_below(VISIBLE * body.size / largest * 1.25)
    gap = max((float(np.nanmax(geometry.part["gap"], initial=0.0)) for geometry in parts), default=0.0)
    return DeformedBody(body, u, factor if factor * gap < NEAR * body.size else 1.0)


def largest_stress(parts: list[PartGeometry]) -> float:
    """The largest |σ_n| on any of them, N/m²."""
    return max((float(np.nanmax(np.abs(f.part.pressure), initial=0.0)) for f in parts), default=0.0)
