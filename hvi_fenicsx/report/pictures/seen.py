"""What is seen of surfaces in space that hide each other, as images of one picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...typing import Array, Integers, Mask
from .raster import shade
from .vtk_view import View, area_vectors

PIXELS = 300
"""Along the longer side of the picture."""
NEARER = 2e-3
"""A surface is seen up to this part of the picture's width behind another one."""


@dataclass(frozen=True, kw_only=True)
class Surface:
    """A surface as it is drawn.

    Attributes:
        points: m, (n, 3).
        facets: counterclockwise seen from outside, (k, 3).
    """

    points: Array
    facets: Integers

    @property
    def used(self) -> Array:
        """The points of its facets, m, (m, 3)."""
        return self.points[np.unique(self.facets)]


@dataclass(frozen=True, kw_only=True)
class Seen:
    """What is seen of a surface.

    Attributes:
        image: the pixels where it is seen, rows from below, (h, w).
        low: the lower left corner of the image, m, (2,).
        width: of a pixel, m.
    """

    image: Mask
    low: Array
    width: float

    @cached_property
    def middles(self) -> Array:
        """The middles of the pixels where it is seen, m, (m, 2)."""
        rows, columns = np.nonzero(self.image)
        return np.asarray(self.low + self.width * (np.column_stack([columns, rows]) + 0.5))

    @cached_property
    def middle(self) -> Array:
        """The place where it is seen that is nearest to the mean of all, m, (2,)."""
        away = np.linalg.norm(self.middles - self.middles.mean(axis=0), axis=1)
        return np.asarray(self.middles[int(np.argmin(away))])

    @cached_property
    def area(self) -> float:
        """m²."""
        return float(np.count_nonzero(self.image)) * self.width**2

    def within(self, boxes: Array) -> Array:
        """The area that is seen in boxes, m², (k,).

        Args:
            boxes: left, lower, right and upper end, m, (k, 4).
        """
        left, lower, right, upper = ((boxes - np.tile(self.low, 2)) / self.width).T
        to_right, to_left = (self._below(upper, end) - self._below(lower, end) for end in (right, left))
        return np.asarray((to_right - to_left) * self.width**2)

    def _below(self, up: Array, across: Array) -> Array:
        """How many pixels are seen to the left of places and below them, (k,); exact within pixels."""
        from scipy.ndimage import map_coordinates  # which pictures in the plane need not wait for

        return np.asarray(map_coordinates(self._sums, [up, across], order=1, mode="nearest"))

    @cached_property
    def _sums(self) -> Array:
        return np.pad(self.image.astype(np.float64).cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))


def seen(view: View, surfaces: Sequence[Surface]) -> list[Seen]:
    """What is seen of each of several surfaces; of one that the others hide, or that looks away, where it is.

    Args:
        view: from where they are seen.
        surfaces: what is drawn.
    """
    drawn = np.concatenate([view.project(surface.used) for surface in surfaces])
    low, extent = drawn.min(axis=0), np.ptp(drawn, axis=0)
    width = (float(extent.max()) or 1.0) / PIXELS
    shape = max(1, round(float(extent[1]) / width)), max(1, round(float(extent[0]) / width))

    def depths(surface: Surface, facets: Integers) -> Array:
        pixels = (view.project(surface.points) - low) / width
        return shade(pixels, facets, view.depth(surface.points)[facets], shape)

    own = [depths(surface, _facing(view, surface)) for surface in surfaces]
    nearest = np.fmax.reduce(own) - NEARER * PIXELS * width
    images = [np.asarray(depth >= nearest) for depth in own]
    hidden = (~np.isnan(depths(surface, surface.facets)) for surface in surfaces)
    shown = [image if image.any() else other for image, other in zip(images, hidden, strict=True)]
    return [Seen(image=image, low=low, width=width) for image in shown]


def _facing(view: View, surface: Surface) -> Integers:
    """The facets that look at the eye."""
    return surface.facets[area_vectors(surface.points, surface.facets) @ view.toward > 0.0]
