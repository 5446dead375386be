"""The canvas of a picture of a body, and a plane body painted on it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import PathPatch

from ...typing import Array
from .deformed import DeformedBody
from .legend import FOOT
from .outline import closed_path
from .raster import thinned
from .reach import Reach, corners, largest_scale
from .style import DPI, GREY, HEADING, INK, area, figure

MARGIN, SIDE = 0.3, 7.4
"""Inches: left and right of the body, and its largest width."""
TALLEST, FLATTEST = 6.4, 2.2
FEWEST_PIXELS = 13
"""Mesh lines are drawn if they are so far apart."""


def canvas(reaches: Sequence[Reach]) -> tuple[Figure, Axes]:
    """Axes without a frame for all that is drawn: a picture just high enough for it, or as wide as it needs it.

    Args:
        reaches: what is drawn.
    """
    scale = largest_scale(reaches, (SIDE, TALLEST))
    low, high = corners(reaches, scale)
    tall = max(FLATTEST, float(high[1] - low[1]))
    fig = figure(HEADING + tall + FOOT + 0.1)
    axes = area(fig, MARGIN, FOOT, SIDE, tall)
    axes.set_axis_off()
    middle, half = (low + high) / scale / 2, np.array([SIDE, tall]) / scale / 2
    axes.set_xlim(middle[0] - half[0], middle[0] + half[0])
    axes.set_ylim(middle[1] - half[1], middle[1] + half[1])
    return fig, axes


def window(axes: Axes) -> Array:
    """What axes show: the lower left and the upper right corner, m, and their distance apart in inches, (3, 2)."""
    box = axes.get_window_extent()
    inches = np.array([box.width, box.height]) / axes.figure.dpi
    return np.array([*np.transpose([axes.get_xlim(), axes.get_ylim()]), inches])


def paint(axes: Axes, shape: DeformedBody, values: Array, colours: Colormap, end: float) -> None:
    """Draw a plane body over its undeformed outline, in the colours of values at the corners of its cells.

    Args:
        axes: to draw on.
        shape: the deformed body.
        values: at the corners of each cell, (c, 3).
        colours: of the values, from zero.
        end: the value at the end of the colours.
    """
    body, points = shape.body, shape.points
    outline = closed_path(points, body.outline)
    drawn = _shading(axes, shape, values, lambda image: colours(image / (end or 1.0), bytes=True))
    drawn.set_clip_path(outline, axes.transData)
    for patch, style in (
        (closed_path(shape.at_rest, body.outline), {"ec": GREY, "ls": (0, (5, 4)), "lw": 1.3, "zorder": 3}),
        (outline, {"ec": INK, "lw": 1.6, "zorder": 4}),
    ):
        axes.add_artist(PathPatch(patch, fc="none", joinstyle="round", **style))
    if _pixels_between_lines(axes, shape) >= FEWEST_PIXELS:
        sides = np.unique(np.sort(np.concatenate([body.cells[:, c] for c in ((0, 1), (1, 2), (2, 0))]), axis=1), axis=0)
        axes.add_collection(LineCollection(list(points[sides, :2]), colors="white", lw=0.6, alpha=0.5, zorder=2))


def _pixels_between_lines(axes: Axes, shape: DeformedBody) -> float:
    per_metre = SIDE * DPI / float(np.ptp(axes.get_xlim()))
    return per_metre * float(np.sqrt(np.prod(np.ptp(shape.at_rest[:, :2], axis=0)) / len(shape.body.cells)))


def _shading(axes: Axes, shape: DeformedBody, values: Array, coloured: Callable[[Array], Any]) -> AxesImage:
    """Values as an image of the picture's own pixels, coloured here: matplotlib would resample values and mask."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    wide = round(SIDE * DPI)
    tall = round(wide * (top - bottom) / (right - left))
    pixels = (shape.points[:, :2] - [left, bottom]) * [wide / (right - left), tall / (top - bottom)]
    image = thinned(pixels, shape.body.cells, values, (tall, wide))
    extent = (left, right, bottom, top)
    return axes.imshow(coloured(image), origin="lower", extent=extent, interpolation="nearest", aspect="auto", zorder=1)
