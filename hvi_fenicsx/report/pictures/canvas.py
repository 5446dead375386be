"""The canvas of a picture of a body: axes just high enough for it, scales and legend below, labels that stand free."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.patches import FancyArrowPatch
from matplotlib.path import Path
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedLocator, MaxNLocator
from matplotlib.transforms import Bbox, BboxBase

from ...typing import Array
from ..body_mesh import BodyMesh
from ..reader import Result
from .shape import DeformedBody, PartGeometry
from .sides import HeldSide, LoadedSide, Side
from .style import GREY, HEADING, INK, VERMILION, WIDTH, area, figure, heading

MARGIN = 0.3
"""Inches: left and right of the body."""
LETTERS = 12
"""Points: the size of a label's letters."""
_WAYS = np.array([[0, 1], [1, 0], [-1, 0], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]])
"""Where else a label is tried beside its point."""


@dataclass(frozen=True)
class Label:
    """Words at a point, or beside it.

    Attributes:
        words: the words.
        at: the point, m, (2,).
        way: from there to the words, (2,); zero where they are written on the point.
        colour: of the letters; those in ink are bold.
    """

    words: str
    at: Array
    way: Array
    colour: str = INK

    @property
    def beyond(self) -> Array:
        """About how far it reaches beyond its point along each axis, and before it where negative, inches, (2,)."""
        return np.round(self.way) * np.array([0.7 * len(self.words), 1.6]) * LETTERS / 72


@dataclass(frozen=True)
class Scale:
    """A scale of colours with a bar.

    Attributes:
        colours: of the scale.
        low: its lowest value.
        high: its largest value.
        words: what it shows, in which unit.
        remark: below it.
    """

    colours: Colormap
    low: float
    high: float
    words: str
    remark: str = ""


@dataclass
class Canvas(ABC):
    """What is drawn of a body, as far as that is alike in the plane and in space.

    Attributes:
        result: whose body it is.
        subject: what the picture shows.
        reached: points of the picture's plane that what is drawn reaches, m, (n, 2) each.
        labels: the words in it.
        keys: the lines of the legend by their words.
        scales: those with bars.
        remarks: lines beside the legend with their colours; what is bad is bold.
    """

    result: Result
    subject: str
    reached: list[Array] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)
    keys: dict[str, Artist] = field(default_factory=dict)
    scales: list[Scale] = field(default_factory=list)
    remarks: list[tuple[str, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Make the figure; its height is known in the end."""
        self.fig = figure(HEADING)
        self.axes = area(self.fig, MARGIN, 0.0, WIDTH - 2 * MARGIN, HEADING)
        self.axes.set_axis_off()

    @abstractmethod
    def sides(self, shape: DeformedBody, sides: Sequence[Side], contacts: Sequence[str], held: Sequence[str]) -> None:
        """Name the parts, and show what acts on them.

        Args:
            shape: the body as it is drawn.
            sides: the parts.
            contacts: the names of those with contact or a law.
            held: the names of those with a support.
        """

    @abstractmethod
    def supports(self, shape: DeformedBody, found: Sequence[HeldSide]) -> None:
        """Draw the supports.

        Args:
            shape: the body as it is drawn.
            found: the sides that are held.
        """

    @abstractmethod
    def loads(self, shape: DeformedBody, found: Sequence[LoadedSide]) -> None:
        """Draw arrows onto a side where it is pushed, from it where it is pulled, off it where they are along it.

        Args:
            shape: the body as it is drawn.
            found: the sides with loads.
        """

    @abstractmethod
    def contacts(self, shape: DeformedBody, parts: Sequence[PartGeometry], *, pressure: bool) -> None:
        """Draw the obstacles and the pressure on the parts.

        Args:
            shape: the body as it is drawn.
            parts: those with contact or a law.
            pressure: whether the body is painted with it where its parts are hidden.
        """

    @abstractmethod
    def ghost(self, body: BodyMesh, points: Array, ways: Array) -> None:
        """Draw a body where a motion brings it, and the ways of some of its points.

        Args:
            body: the body.
            points: its points there, m, (n, d).
            ways: m, (j, k, d).
        """

    def key(self, *artists: Artist) -> None:
        """Add lines to the legend, each words once."""
        for artist in artists:
            self.keys.setdefault(str(artist.get_label()), artist)

    def lay_out(self, tallest: float = 6.4, flattest: float = 2.0) -> None:
        """Give the picture its height and the axes their limits; write what is around them.

        Args:
            tallest: the largest height of the axes, inches.
            flattest: the smallest one.
        """
        points = np.concatenate(self.reached)
        low, high = points.min(axis=0), points.max(axis=0)
        before, behind = self._room()
        wide, extent = WIDTH - 2 * MARGIN, np.maximum(high - low, 1e-9 * float(np.ptp(points, axis=0).max() or 1.0))
        scale = float(np.min((np.array([wide, tallest]) - before - behind) / extent))
        tall = max(flattest, float((scale * extent + before + behind)[1]))
        lines = sum(words.count("\n") + 1 for words in self.keys)
        foot = max(1.5, 0.3 + 0.24 * lines)
        height = HEADING + tall + foot
        self.fig.set_figheight(height)
        self.axes.set_position((MARGIN / WIDTH, foot / height, wide / WIDTH, tall / height))
        middle, half = (low + high + (behind - before) / scale) / 2, np.array([wide, tall]) / scale / 2
        self.axes.set(xlim=(middle[0] - half[0], middle[0] + half[0]), ylim=(middle[1] - half[1], middle[1] + half[1]))
        heading(self.fig, self.result, self.subject)
        self._foot(foot)

    def follow(self, ways: Array) -> None:
        """Draw arrows along ways in the picture's plane, m, (j, k, 2)."""
        for way in ways:
            style = "-|>,head_length=9,head_width=5"
            arrow = FancyArrowPatch(path=Path(way), arrowstyle=style, color=VERMILION, lw=3.2, zorder=7, shrinkB=0)
            arrow.set_clip_on(False)
            self.axes.add_patch(arrow)
            self.reached.append(way)

    def _room(self) -> tuple[Array, Array]:
        """What labels may take left of the points and below them, and right of them and above, inches, (2,) each."""
        beyond = np.array([np.zeros(2), *(label.beyond for label in self.labels)])
        return 0.08 - beyond.min(axis=0), 0.08 + beyond.max(axis=0)

    def _foot(self, foot: float) -> None:
        """Write bars, remarks and legend."""
        for place, scale in enumerate(self.scales):
            bar, spread = area(self.fig, 0.42 + 3.75 * place, foot - 0.68, 3.2, 0.2), scale.high > scale.low
            mappable = ScalarMappable(Normalize(scale.low, scale.high if spread else scale.low + 1.0), scale.colours)
            ticks = MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]) if spread else FixedLocator([scale.low])
            self.fig.colorbar(mappable, cax=bar, orientation="horizontal", ticks=ticks)
            bar.spines[:].set_visible(False)
            bar.set_title(scale.words, loc="left", size=12.5)
            bar.set_xlabel(scale.remark, loc="left", labelpad=7, size=12.5, weight="bold", color=GREY)
        for line, (words, colour) in enumerate(self.remarks):
            up = (foot - 0.4 - 0.34 * line) / self.fig.get_figheight()
            weight = "bold" if colour == VERMILION else "normal"
            self.fig.text(MARGIN / WIDTH, up, words, size=12.5, color=colour, weight=weight, va="center")
        if self.keys and len(self.scales) < 2:
            centre = (4.05 / WIDTH, foot / 2 / self.fig.get_figheight())
            self.fig.legend(
                handles=list(self.keys.values()),
                loc="center left",
                bbox_to_anchor=centre,
                frameon=False,
                fontsize=11.5,
                labelspacing=0.3,
            )

    def write(self, drawn: Array) -> None:
        """Write the labels, each where it covers no other one, and as little as possible of what is drawn.

        Args:
            drawn: points that are better not covered, m, (n, 2).
        """
        vertices, taken = self.axes.transData.transform(drawn), list[Bbox]()
        for label in self.labels:
            text = self._written(label)
            text.get_window_extent()  # which puts it in its place
            box = Text.get_window_extent(text)  # without the line that leads to it
            places = _places(label, np.array(box.size) * 36 / self.fig.dpi)
            boxes = [box.translated(*(place * self.fig.dpi / 72)) for place in places]
            costs = [_cost(one, taken, vertices, self.fig.bbox) for one in boxes]
            best = costs.index(min(costs))
            text.xyann = (float(places[best][0]), float(places[best][1]))
            assert text.arrow_patch is not None
            text.arrow_patch.set_visible(float(np.abs(places[best] - places[0]).max()) > 0.0)
            taken.append(boxes[best])

    def _written(self, label: Label) -> Annotation:
        """A label on its point, with a line that leads there once it is moved."""
        return self.axes.annotate(
            label.words,
            (float(label.at[0]), float(label.at[1])),
            (0.0, 0.0),
            textcoords="offset points",
            ha="center",
            va="center",
            size=LETTERS,
            weight="bold" if label.colour == INK else "normal",
            color=label.colour,
            bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none", "alpha": 0.85},
            arrowprops={"arrowstyle": "-", "color": label.colour, "lw": 0.9, "shrinkB": 0},
            annotation_clip=False,
            zorder=9,
        )


def _places(label: Label, half: Array) -> list[Array]:
    """Where the middle of a label may stand, points from its point: where it is wanted, then ever farther around.

    Args:
        label: the label.
        half: of the size of its letters, points, (2,).
    """
    length = float(np.linalg.norm(label.way))
    wanted = label.way / length if length > 0.0 else label.way
    near, far = half + LETTERS / 3, half + 2 * LETTERS
    return [wanted * near, *(way * room for room in (near, far, far + 2 * LETTERS) for way in _WAYS)]


def _cost(box: Bbox, taken: Sequence[Bbox], vertices: Array, window: BboxBase) -> tuple[int, int]:
    """How many labels a box covers, where one that leaves the picture counts as well; and how many points."""
    leaves = not (window.contains(*box.min) and window.contains(*box.max))
    return box.count_overlaps(taken) + leaves, box.count_contains(vertices)
