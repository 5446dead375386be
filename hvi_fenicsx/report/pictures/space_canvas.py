"""The canvas of a picture of a body in space; in the emptiest of its corners it says which way the coordinates grow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from ...typing import Array
from .plane_canvas import canvas, window
from .reach import Reach
from .style import GREY
from .vtk_view import View

LENGTH, LETTER, EDGE = 0.36, 0.11, 0.04
"""Inches: an axis across the view, from its end to the middle of its letter, what is left free around."""


def space_canvas(view: View, reaches: Sequence[Reach]) -> tuple[Figure, Axes]:
    """The canvas of :func:`.plane_canvas.canvas`, with the three axes.

    Args:
        view: from where the body is seen.
        reaches: what is drawn.
    """
    fig, axes = canvas(reaches)
    low, high, inches = window(axes)
    scale = float(inches[0] / (high[0] - low[0]))
    ends = np.asarray(view.project(np.eye(3)) * LENGTH / scale)
    box = _box(ends, (LETTER + EDGE + LETTER) / scale)
    corners = [np.array([x, y]) for y in (0, 1) for x in (0, 1)]
    origins = [np.where(corner, high - box[1], low - box[0]) for corner in corners]
    taken = shapely.union_all([reach.hull(scale) for reach in reaches if len(reach.points)])
    boxes = np.array([shapely.box(*(box + origin).ravel()) for origin in origins])
    best = origins[int(np.argmin(np.round(shapely.area(shapely.intersection(boxes, taken)) * scale**2, 3)))]
    for name, end in zip("xyz", ends, strict=True):
        _axis(axes, name, best, end, LETTER / scale)
    return fig, axes


def _box(ends: Array, room: float) -> Array:
    """The lower left and the upper right corner of what the axes take, from where they begin, (2, 2)."""
    points = np.concatenate([ends, np.zeros((1, 2))])
    return np.array([points.min(axis=0) - room, points.max(axis=0) + room])


def _axis(axes: Axes, name: str, origin: Array, end: Array, letter: float) -> None:
    halo = [withStroke(linewidth=3.0, foreground="white")]
    arrow = {"arrowstyle": "-|>,head_length=0.35,head_width=0.15", "color": GREY, "lw": 1.3, "shrinkA": 0, "shrinkB": 0}
    beyond = end * (1.0 + letter / (float(np.hypot(*end)) or 1.0))
    (x, y), (right, up), (across, above) = (
        (float(point[0]), float(point[1])) for point in (origin, origin + end, origin + beyond)
    )
    axes.annotate("", (right, up), (x, y), arrowprops=arrow, annotation_clip=False, zorder=8)
    axes.text(across, above, name, size=12, color=GREY, ha="center", va="center", zorder=8, path_effects=halo)
