"""The canvas of a picture of a body: axes just high enough for it, scales and legend below, labels that stand free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.artist import Artist
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import FancyArrowPatch
from matplotlib.text import Annotation, Text
from matplotlib.ticker import FixedLocator, MaxNLocator
from matplotlib.transforms import Bbox

from ...typing import Array
from ..reader import Result
from .shape import ARROW, DeformedBody, HeldSide, LoadedSide, Side, sparse
from .style import BLUE, INK, VERMILION, WIDTH, figure, heading, resize

SHEAR = 0.2
"""A load is along its side, and arrows to it would lie on it, where the part across is at most this part of it."""
LETTERS = 12
"""Points: the size of a label's letters."""
CONTACT, SUPPORT, LOADED = ("#eea06d", "contact, friction or adhesion"), ("#9fb7c9", "support"), ("#f3cf7a", "loaded")
"""What acts on a part: its colour in the picture of a scene, and its words."""
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


@dataclass
class Canvas:
    """What is drawn of a body, as far as that is alike in the plane and in space.

    Attributes:
        result: whose body it is.
        subject: what the picture shows.
        reached: points of the picture's plane that what is drawn reaches, m, (n, 2) each.
        labels: the words in it.
        keys: the lines of the legend by their words.
        tallest: the largest height of the axes, inches.
        toward: the unit vector from the body towards the eye, (3,).
    """

    result: Result
    subject: str
    reached: list[Array] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)
    keys: dict[str, Artist] = field(default_factory=dict)
    tallest: float = 6.4
    toward: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))

    def __post_init__(self) -> None:
        """Make the figure; its height is known in the end."""
        self.fig = figure(self.tallest)
        self.axes = self.fig.add_subplot()
        self.axes.set_axis_off()
        self._bars = 0

    def key(self, *artists: Artist) -> None:
        """Add lines to the legend, each words once."""
        for artist in artists:
            self.keys.setdefault(str(artist.get_label()), artist)

    def remark(self, words: str, colour: str = INK) -> None:
        """Add words to the legend.

        Args:
            words: the words.
            colour: of them; what is bad is in vermilion.
        """
        self.key(Line2D([], [], color="none", mec=colour, label=words))

    def bar(self, colours: Colormap, low: float, high: float, words: str) -> None:
        """Add a bar below the body with its scale of colours.

        Args:
            colours: of the scale.
            low: its lowest value.
            high: its largest value.
            words: what it shows, in which unit.
        """
        mappable = ScalarMappable(Normalize(low, high if high > low else low + 1.0), colours)
        ticks = MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]) if high > low else FixedLocator([low])
        bar = self.fig.colorbar(mappable, ax=self.axes, location="bottom", ticks=ticks, aspect=45, pad=0.03)
        bar.outline.set_visible(False)  # type: ignore[operator]
        bar.set_label(words, size=12.5)
        self._bars += 1

    def extent(self) -> tuple[Array, Array]:
        """The lowest and the highest point of what is drawn, with a margin, m, (2,) each."""
        points = np.concatenate(self.reached)
        low, high = points.min(axis=0), points.max(axis=0)
        margin = 0.015 * float((high - low).max() or 1.0)
        return low - margin, high + margin

    def lay_out(self) -> None:
        """Give the picture its height and the axes their limits; write what is around them."""
        low, high = self.extent()
        wide, tall = (float(side) for side in high - low)
        columns = 1 if max(map(len, self.keys), default=0) > 34 else 2
        foot = 0.9 * self._bars + 0.27 * sum(words.count("\n") + 1 for words in self.keys) / columns
        resize(self.fig, min(self.tallest, 0.6 + WIDTH * tall / wide) + foot + 0.2)
        self.axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
        heading(self.fig, self.result, self.subject)
        for artist in self.axes.get_children():
            artist.set_in_layout(False)  # all are within the limits, and labels come after
        if self.keys:
            handles = list(self.keys.values())
            self.fig.legend(handles=handles, loc="outside lower center", ncols=columns, labelcolor="mec")

    def follow(self, ways: Array) -> None:
        """Draw arrows from one point to another in the picture's plane, m, (j, 2, 2)."""
        style = "-|>,head_length=9,head_width=5"
        for way in ways:
            self.axes.add_patch(FancyArrowPatch(*way, arrowstyle=style, color=VERMILION, lw=3.2, zorder=7, shrinkB=0))
            self.reached.append(way)

    def project(self, points: Array) -> Array:
        """Points (n, 3) in the picture's plane, (n, 2), m."""
        return points[:, :2]

    def sides(self, shape: DeformedBody, sides: Sequence[Side], contacts: Sequence[str], held: Sequence[str]) -> None:
        """Name the parts, and colour them by what acts on them.

        Args:
            shape: the body as it is drawn.
            sides: the parts.
            contacts: the names of those with contact or a law.
            held: the names of those with a support.
        """
        for side in sides:
            kind = CONTACT if side.part in contacts else SUPPORT if side.part in held else LOADED
            self.tint(shape, side, *kind)
            facing = side.normals @ self.toward >= 0.0
            seen = np.flatnonzero(facing) if facing.any() else np.arange(len(facing))
            points = self.project(shape.at_rest[side.vertices[seen]])
            middle = int(np.argmin(np.linalg.norm(points - points.mean(axis=0), axis=1)))
            inwards = -self.project(side.normals[seen])[middle] * (shape.body.dimension == 2)
            name = side.part if facing.any() else f"{side.part} (behind)"
            self.labels.append(Label(name, points[middle], inwards, BLUE))

    def tint(self, shape: DeformedBody, side: Side, colour: str, words: str) -> None:
        """Colour a part.

        Args:
            shape: the body as it is drawn.
            side: the part.
            colour: its colour.
            words: what acts on it, for the legend.
        """
        raise NotImplementedError

    def supports(self, shape: DeformedBody, found: Sequence[HeldSide]) -> None:
        """Draw the supports; in space a picture of the scene colours them, others leave them out.

        Args:
            shape: the body as it is drawn.
            found: the sides that are held.
        """

    def loads(self, shape: DeformedBody, found: Sequence[LoadedSide]) -> None:
        """Draw arrows onto a side where it is pushed, from it where it is pulled, off it where they are along it.

        Args:
            shape: the body as it is drawn.
            found: the sides with loads.
        """
        long = ARROW * shape.body.size
        for load in found:
            there = np.flatnonzero(np.linalg.norm(load.traction, axis=1) > load.largest / 8)
            chosen = there[sparse(shape.points[load.side.vertices[there]], 1.4 * long)]
            feet, normals = shape.points[load.side.vertices[chosen]], load.side.normals[chosen]
            ways = load.traction[chosen] * (long / load.largest)
            outward = np.sum(ways * normals, axis=1, keepdims=True)
            beside = np.abs(outward) <= SHEAR * np.linalg.norm(ways, axis=1, keepdims=True)
            tails = feet + np.where(beside, long / 4 * normals - ways / 2, np.where(outward < 0.0, -ways, 0.0))
            self.arrows(tails, ways)
            ends, way = self.project(np.concatenate([tails, tails + ways])), self.project(load.side.normal[None])[0]
            self.reached.append(ends)
            out = way / (float(np.linalg.norm(way)) or 1.0)
            middle = ends.mean(axis=0)
            self.labels.append(Label(load.value, middle + float(((ends - middle) @ out).max()) * out, out))

    def arrows(self, tails: Array, ways: Array) -> None:
        """Draw the arrows of a load.

        Args:
            tails: where they begin, m, (k, 3).
            ways: from there to their tips, m, (k, 3).
        """
        raise NotImplementedError

    def write(self) -> None:
        """Write the labels, each where it is wanted, or as near to that as it covers no other one."""
        if engine := self.fig.get_layout_engine():
            engine.execute(self.fig)
        self.axes.apply_aspect()
        taken, dots = list[Bbox](), self.fig.dpi / 72
        for label in self.labels:
            text = self._written(label)
            text.get_window_extent()  # which puts it in its place
            box = Text.get_window_extent(text)  # without the line that leads to it
            places = _places(label, np.array(box.size) / dots / 2)
            boxes = [box.translated(*(place * dots)) for place in places]
            best = int(np.argmin([one.count_overlaps(taken) for one in boxes]))
            text.set(position=places[best])
            assert text.arrow_patch is not None
            text.arrow_patch.set_visible(best > 0)
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
