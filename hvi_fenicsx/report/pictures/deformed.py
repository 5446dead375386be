"""The deformed body, magnified, and what acts on its contact parts, as points: the same in the plane and in space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...typing import Array, Integers
from ..reader import Part, Result
from ..units import round_below
from ..vtu import Body

VISIBLE = 0.08
"""How large the largest displacement is drawn, of the body's size."""
PEAK, SPOILS = 0.005, 1.25
"""Of the body's volume, left beyond the end of a scale; how many times its end the peak must be."""
NEAR = 0.3
"""Gaps larger than this, magnified, of the body's size, are the body's own shape."""


@dataclass(frozen=True)
class Deformed:
    """A body with its displacement (n, 3), m, and the factor it is drawn with."""

    body: Body
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
class Footing:
    """A contact part on the body: its vertices (m,), its facets (k, 2|3), and the row of the table by vertex.

    ``obstacle`` is the unit vector (3,) towards it where that is flat, None where its gap is along the part's normals.
    """

    part: Part
    vertices: Integers
    facets: Integers
    row: Integers
    obstacle: Array | None

    def values(self, column: Array, vertices: Integers) -> Array:
        """A column of the table at some of its vertices."""
        return np.asarray(column[self.row[vertices]])


def footings(result: Result, body: Body) -> list[Footing]:
    """All contact parts, placed on the body."""
    found = []
    for part in result.parts:
        vertices = body.vertices(part.points)
        row = np.zeros(len(body.points), dtype=np.int64)
        row[vertices] = np.arange(len(vertices))
        found.append(Footing(part, vertices, body.facets_of(vertices), row, result.obstacle(part.name)))
    return found


def deform(body: Body, parts: Sequence[Footing]) -> Deformed:
    """The body with a round factor that makes its displacement seen.

    Where a part leaves its obstacle by its own shape, as a disk does a floor, the factor is 1: magnified, displacements
    would push the body through the obstacle.
    """
    u = np.nan_to_num(body.fields["displacement"])
    largest = float(np.linalg.norm(u, axis=1).max(initial=0.0))
    if largest == 0.0:
        return Deformed(body, u, 1.0)
    factor = 1.0 if largest > 0.5 * VISIBLE * body.size else round_below(VISIBLE * body.size / largest * 1.25)
    gap = max((float(np.nanmax(foot.part["gap"], initial=0.0)) for foot in parts), default=0.0)
    return Deformed(body, u, factor if factor * gap < NEAR * body.size else 1.0)


@dataclass(frozen=True)
class Scale:
    """A scale for numbers of the cells, from zero; ``cut`` where it ends below the largest of them."""

    end: float
    largest: float

    @property
    def cut(self) -> bool:
        """Whether some cells have more."""
        return self.end < self.largest


def scale_of(body: Body, values: Array) -> Scale:
    """A scale that a peak in a corner does not spoil: it ends where a share ``PEAK`` of the body has more."""
    sides = body.points[body.cells[:, 1:]] - body.points[body.cells[:, :1]]
    volume = np.sqrt(np.linalg.det(sides @ sides.transpose(0, 2, 1)))
    order = np.argsort(values)
    share = np.cumsum(volume[order]) / volume.sum()
    end, largest = float(values[order][np.searchsorted(share, 1.0 - PEAK)]), float(values.max())
    return Scale(end if 0.0 < end < largest / SPOILS else largest, largest)


def largest_stress(parts: list[Footing]) -> float:
    """The largest |σ_n| on any of them, N/m²."""
    return max((float(np.nanmax(np.abs(f.part.pressure), initial=0.0)) for f in parts), default=0.0)
