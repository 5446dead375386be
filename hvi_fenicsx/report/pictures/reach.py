"""How far what a picture shows reaches: points of the body's plane, and letters or lines around them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from ...typing import Array
from .style import INK

LINE = 0.03
"""Inches: half of the widest line, which is drawn around each point."""
LETTERS, APART = 12.5, 0.09
"""The size of a label's letters, points, and how far it stands from what it labels, inches."""
SLANTED = 0.35
"""What both parts of a way are that is neither along an axis nor nearly so."""
_TURNS = np.radians(np.arange(0.0, 360.0, 45.0))
WAYS = np.column_stack([np.cos(_TURNS), np.sin(_TURNS)])
"""Where a label may stand beside a point."""


@dataclass(frozen=True)
class Reach:
    """Points that a picture shows.

    Attributes:
        points: m, (n, 2).
        before: what is drawn to the left of each point and below it, inches, (2,).
        behind: what is drawn to the right of each point and above it, inches, (2,).
    """

    points: Array
    before: Array = field(default_factory=lambda: np.full(2, LINE))
    behind: Array = field(default_factory=lambda: np.full(2, LINE))

    def hull(self, scale: float) -> shapely.Geometry:
        """What lies between the outermost of the points and of what is drawn around them, m.

        Args:
            scale: inches for a metre.
        """
        low, high = self.points - self.before / scale, self.points + self.behind / scale
        others = [np.column_stack([low[:, 0], high[:, 1]]), np.column_stack([high[:, 0], low[:, 1]])]
        return shapely.convex_hull(shapely.multipoints(np.concatenate([low, high, *others])))


@dataclass(frozen=True)
class Label:
    """Words at a point, or beside it.

    Attributes:
        words: the words.
        at: the point, m, (2,).
        way: from there to the words, (2,), of length 1; zero where they are written on the point.
        weight: of the letters.
        colour: of the letters.
        upright: whether they are written upwards.
        away: how far the words stand from the point, inches; a line leads to those that are not beside it.
    """

    words: str
    at: Array
    way: Array
    weight: str = "bold"
    colour: str = INK
    upright: bool = False
    away: float = APART

    @property
    def _size(self) -> Array:
        size = letters(self.words, LETTERS, self.weight)
        return size[::-1] if self.upright else size

    @property
    def _away(self) -> Array:
        """From ``at`` to the middle of the letters, inches: all lie beyond ``at``, a corner there on a slanted way."""
        if np.abs(self.way).min() > SLANTED:
            return np.asarray(np.sign(self.way) * self._size / 2 + self.away * self.way)
        return np.asarray(self.way * (float(np.abs(self.way) @ self._size) / 2 + self.away))

    @property
    def _leads(self) -> bool:
        return self.away > APART and bool(np.any(self.way))

    @property
    def reach(self) -> Reach:
        """What it takes."""
        half = self._size / 2
        return Reach(self.at[None], half - self._away, half + self._away)

    def draw(self, axes: Axes) -> None:
        """Write it.

        Args:
            axes: to write on.
        """
        (x, y), (right, up) = (map(float, pair) for pair in (self.at, 72 * self._away))
        axes.annotate(
            self.words,
            (x, y),
            (right, up),
            textcoords="offset points",
            ha="center",
            va="center",
            size=LETTERS,
            weight=self.weight,
            color=self.colour,
            rotation=90 if self.upright else 0,
            bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.85},
            arrowprops={"arrowstyle": "-", "color": self.colour, "lw": 0.9, "shrinkB": 0} if self._leads else None,
            annotation_clip=False,
            zorder=9,
        )


def boxes(labels: Sequence[Label], scale: float) -> Array:
    """What the letters of labels take, m: shapely's rectangles, (k,).

    Args:
        labels: each at one point.
        scale: inches for a metre.
    """
    taken = [label.reach for label in labels]
    low = np.array([one.points[0] - one.before / scale for one in taken])
    high = np.array([one.points[0] + one.behind / scale for one in taken])
    return np.asarray(shapely.box(*low.T, *high.T))


def letters(words: str, size: float, weight: str = "normal") -> Array:
    """The width and the height of a line of letters, inches, (2,).

    Args:
        words: the line.
        size: of the letters, points.
        weight: of the letters, as matplotlib names it.
    """
    return np.array([_width(words, size, weight), 1.2 * size]) / 72


@functools.cache
def _width(words: str, size: float, weight: str) -> float:
    """Points; kept, since it takes milliseconds and a label is tried in a hundred places."""
    letters = FontProperties(weight=weight, size=size)
    return float(text_to_path.get_text_width_height_descent(words, letters, ismath=False)[0])


def largest_scale(reaches: Sequence[Reach], room: tuple[float, float]) -> float:
    """How large the points may be drawn, inches for a metre, so that all fits.

    Args:
        reaches: what is drawn.
        room: width and height, inches.
    """
    low, high, before, behind = _ends(reaches)
    extent = high[:, None] - low[None]  # from the lowest point of one to the highest of another
    free = np.array(room) - behind[:, None] - before[None]
    longest = float(extent.max())
    counted = extent > 1e-3 * longest
    return float((free[counted] / extent[counted]).min()) if longest > 0.0 else min(room)


def corners(reaches: Sequence[Reach], scale: float) -> tuple[Array, Array]:
    """The lower left and the upper right corner of all that is drawn at a scale, inches from the origin, (2,) each.

    Args:
        reaches: what is drawn.
        scale: inches for a metre.
    """
    low, high, before, behind = _ends(reaches)
    return (scale * low - before).min(axis=0), (scale * high + behind).max(axis=0)


def _ends(reaches: Sequence[Reach]) -> tuple[Array, Array, Array, Array]:
    found = [r for r in reaches if len(r.points)]
    # By columns, since numpy takes ten times as long for the ends of many short rows.
    low, high = (np.array([[end(column) for column in r.points.T] for r in found]) for end in (np.min, np.max))
    return low, high, np.array([r.before for r in found]), np.array([r.behind for r in found])
