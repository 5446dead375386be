"""Where a picture draws the vertices of a body: displaced, magnified, stretched where it is thin; or on its way off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..reader import Result
from ..solution_arrays import ContactPart
from ..units import round_below, times

VISIBLE = 0.1
"""The largest displacement is drawn up to this part of the body's size, and the way of an escape three times as far."""
ARROW = 0.14
"""Part of the body's size: the longest arrow of a load, and the highest pressure."""


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
    factor: float = 1.0
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
        facets: its facets in the body, looking outwards, (k, 2) or (k, 3).
        row: of each vertex of the body its row in the part's table, (n,); 0 off the part.
        obstacle: the unit vector (3,) towards a flat obstacle; None where the gap is along the part's normals.
        between_bodies: whether another body is what it meets, which is drawn itself.
    """

    part: ContactPart
    facets: Integers
    row: Integers
    obstacle: Array | None
    between_bodies: bool = False

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
    largest = float(np.linalg.norm(u * stretch, axis=1).max(initial=0.0))
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


@dataclass(frozen=True)
class Motion:
    """A finite rigid motion, x → exp(t A) x in homogeneous coordinates.

    Attributes:
        generator: A, (4, 4): the velocity at x is A x.
    """

    generator: Array

    def at(self, points: Array, part: float = 1.0) -> Array:
        """Where points are after a part of the motion, m, (n, 3).

        Args:
            points: at rest, m, (n, 3).
            part: of the motion, 0 to 1.
        """
        from scipy.linalg import expm

        way = expm(part * self.generator)
        return np.asarray(points @ way[:3, :3].T + way[:3, 3])


def escaping(body: BodyMesh) -> Motion:
    """The motion whose velocity is the body's escape mode: unlike that, it keeps the body's shape."""
    assert body.escape_mode is not None
    used = np.unique(body.cells)
    points, mode = np.column_stack([body.points[used], np.ones(len(used))]), body.escape_mode[used]
    reach = 3 * VISIBLE * body.size / (float(np.linalg.norm(mode, axis=1).max()) or 1.0)
    generator = np.zeros((4, 4))
    generator[:3] = reach * np.linalg.lstsq(points, mode)[0].T
    return Motion(generator)


def followed(body: BodyMesh, motion: Motion) -> Array:
    """Points to follow on their way: one far out in each diagonal direction that moves, (j, 3).

    Args:
        body: the body at rest.
        motion: that it makes.
    """
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * body.dimension)).reshape(body.dimension, -1).T
    points = body.points[body.outermost]
    far = points[np.unique(np.argmax((points - points.mean(axis=0))[:, : body.dimension] @ signs.T, axis=0))]
    way = np.linalg.norm(motion.at(far) - far, axis=1)
    return np.asarray(far[way > VISIBLE * way.max()])  # not the one that the body turns about
