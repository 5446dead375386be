"""A plane body and what acts around it, drawn by matplotlib: loads, supports, obstacles and contact pressure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Polygon
from matplotlib.path import Path as DrawnPath
from matplotlib.patheffects import Normal, TickedStroke, withStroke
from matplotlib.tri import Triangulation

from ...geometry import chains
from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..solution_arrays import NOTHING
from ..units import quantity
from .canvas import Canvas, Label
from .shape import ARROW, DeformedBody, HeldSide, LoadedSide, PartGeometry, Region, Side
from .style import BLUE, GREY, INK, ORANGE, PURPLE, VERMILION

LEGIBLE = 5000
"""Cells up to which their edges are drawn, in a square body."""
_HALO = [withStroke(linewidth=3.2, foreground="white")]
_ALONG: dict[str, Any] = {"clip_on": False, "solid_capstyle": "butt"}


class PlaneCanvas(Canvas):
    """The canvas of a plane body."""

    def paint(
        self, shape: DeformedBody, values: Array, colours: Colormap, end: float, *, by_cell: bool = False
    ) -> None:
        """Draw the deformed body over the undeformed one, in the colours of values.

        Args:
            shape: the deformed body.
            values: by vertex, (n,), or by cell, (c,).
            colours: of the values, from zero.
            end: the value at the end of the colours.
            by_cell: whether they are by cell.
        """
        cells, points = shape.body.cells, shape.points[:, :2]
        self._fill(points, cells, np.repeat(values, 3) if by_cell else values, cmap=colours, vmax=end or 1.0)
        if len(cells) * shape.body.size**2 <= LEGIBLE * shape.body.volumes.sum():
            self.axes.triplot(*points.T, cells, color="white", lw=0.6, alpha=0.5, zorder=2)
        dashed: dict[str, Any] = {"ls": (0, (5, 4)), "lw": 1.3}
        self._outline(shape.at_rest, shape.body.outline, ec=GREY, zorder=3, **dashed)
        self._outline(points, shape.body.outline, ec=INK, lw=1.6, zorder=4)
        self.key(Line2D([], [], color=GREY, label="undeformed outline", **dashed))

    def _fill(self, points: Array, cells: Integers, values: Any, **look: Any) -> None:
        """Fill cells in the colours of values by vertex, or by corner of each cell: matplotlib's quickest way."""
        if len(values) == cells.size:
            points, cells = points[cells].reshape(-1, 2), np.arange(cells.size).reshape(-1, 3)
        x, y = points.T
        self.axes.tripcolor(Triangulation(x, y, cells), values, shading="gouraud", vmin=0.0, zorder=1, **look)

    def show(self, shape: DeformedBody, areas: Sequence[Region], fill: str) -> None:
        """Draw the body at rest, its regions in their tints.

        Args:
            shape: the body.
            areas: its regions.
            fill: the colour of a body without regions.
        """
        if areas:
            number = np.zeros(len(shape.body.cells))
            for i, area in enumerate(areas):
                number[area.cells] = i
            tints = ListedColormap([area.tint for area in areas])
            corners = np.repeat(number + 0.5, 3)
            self._fill(shape.at_rest[:, :2], shape.body.cells, corners, cmap=tints, vmax=float(len(areas)))
        self._outline(shape.at_rest, shape.body.outline, fc="none" if areas else fill, ec=INK, lw=1.6, zorder=1)

    def _outline(self, points: Array, loops: Sequence[Integers], *, fc: str = "none", **look: Any) -> None:
        """Draw closed chains as one path, holes included."""
        path = DrawnPath.make_compound_path(*(DrawnPath(points[loop, :2], closed=True) for loop in loops))
        self.axes.add_patch(PathPatch(path, fc=fc, joinstyle="round", **look))
        self.reached.append(points[np.concatenate(loops), :2])

    def sides(self, shape: DeformedBody, sides: Sequence[Side], contacts: Sequence[str], held: Sequence[str]) -> None:
        """Name the parts, and show what acts on them.

        Args:
            shape: the body as it is drawn.
            sides: the parts.
            contacts: the names of those with contact or a law.
            held: the names of those with a support.
        """
        for side in sides:
            line = shape.at_rest[side.vertices, :2]
            middle = _at(line, np.hstack([line, side.normals[:, :2]]), np.array([_lengths(line)[-1] / 2]))[0]
            self.labels.append(Label(side.part, middle[:2], -middle[2:], BLUE))
            if side.part in contacts:
                self._line(line, "contact, friction or adhesion", color=VERMILION, lw=5, zorder=2)

    def supports(self, shape: DeformedBody, found: Sequence[HeldSide]) -> None:
        """Draw the supports.

        Args:
            shape: the body as it is drawn.
            found: the sides that are held.
        """
        size = shape.body.size
        for support in found:
            line, outward = shape.points[support.side.vertices, :2], support.side.normals[:, :2]
            width = ARROW / 6 * size if support.rolling else 0.0
            wall = line + width * outward
            strokes = TickedStroke(angle=-135, spacing=8, length=1.0, linewidth=0.9, foreground=GREY)
            self.axes.plot(*wall.T, color=INK, lw=2.2, zorder=3, path_effects=[strokes, Normal()], **_ALONG)
            self.reached.append(wall + ARROW / 5 * size * outward)
            if not support.rolling:
                self.key(Patch(fc="white", ec=GREY, hatch="/////", lw=0.0, label="support"))
                continue
            places = _at(line, line + width / 2 * outward, _spread(line, np.ones(len(line)), size, apart=width))
            rollers: dict[str, Any] = {"color": INK, "marker": "o", "mfc": "white"}
            self.axes.plot(*places.T, ls="", ms=10, mew=1.2, clip_on=False, zorder=5, **rollers)
            self.key(Line2D([], [], lw=2.2, ms=7, label="support, free to slide", **rollers))

    def loads(self, shape: DeformedBody, found: Sequence[LoadedSide]) -> None:
        """Draw arrows onto a side where it is pushed, from it where it is pulled, off it where they are along it.

        Args:
            shape: the body as it is drawn.
            found: the sides with loads.
        """
        size = shape.body.size
        for load in found:
            line, amount = shape.points[load.side.vertices, :2], np.linalg.norm(load.traction, axis=1)
            beside = bool(load.sheared.all())
            at = _spread(line, amount, size, apart=ARROW * size * (1.4 if beside else 0.25), long=ARROW * size * beside)
            arrows = _at(line, load.traction[:, :2], at) * float(ARROW * size / load.largest)
            feet, outward = _at(line, line, at), _at(line, load.side.normals[:, :2], at)
            pushed = np.einsum("ki,ki->k", arrows, outward) < -NOTHING * size
            off = ARROW / 4 * size * outward - arrows / 2 if beside else np.where(pushed[:, None], -arrows, 0.0)
            self._arrows(feet + off, arrows, INK)
            ends, middle = np.concatenate([feet + off, feet + off + arrows]), len(at) // 2
            far = float(((ends - feet[middle]) @ outward[middle]).max(initial=0.0))
            self.labels.append(Label(load.value, feet[middle] + far * outward[middle], outward[middle]))
            self.key(Line2D([0, 1], [0, 0], color=INK, marker=">", ms=7, markevery=(1, 1), lw=1.6, label="load"))

    def _arrows(self, tails: Array, arrows: Array, colour: str) -> None:
        self.axes.quiver(
            *tails.T, *arrows.T, color=colour, angles="xy", scale_units="xy", scale=1.0, units="inches", width=0.03,
            headwidth=4.2, headlength=4.6, headaxislength=4.4, minlength=0.1, clip_on=False, zorder=6,
            path_effects=_HALO,
        )  # fmt: skip
        self.reached += [tails, tails + arrows]

    def contacts(self, shape: DeformedBody, parts: Sequence[PartGeometry]) -> None:
        """Draw the pressure on the parts, and the obstacles where there is room.

        Args:
            shape: the body as it is drawn.
            parts: those with contact or a law.
        """
        stress = np.nan_to_num(np.concatenate([[0.0], *(geometry.part.pressure for geometry in parts)]))
        gap = quantity(max((geometry.part.largest_gap for geometry in parts), default=0.0), "m")
        for geometry in parts:
            for chain in chains(geometry.facets):
                self._contact(shape, geometry, chain, stress, gap)

    def _contact(self, shape: DeformedBody, geometry: PartGeometry, chain: Integers, stress: Array, gap: str) -> None:
        part, rows, line = geometry.part, geometry.row[chain], shape.points[chain, :2]
        outward = shape.body.normals(geometry.facets)[chain, :2]
        if geometry.obstacle is not None:
            outward = np.broadcast_to(geometry.obstacle[:2], outward.shape)
        away = 0.0 if geometry.between_bodies else shape.factor * np.nan_to_num(part["gap"][rows])[:, None]
        base = line + away * outward * shape.stretch[:2]
        if part.has("gap") and not geometry.between_bodies:
            self._line(base, "obstacle", color=GREY, lw=4, zorder=3.5)
        off = part.lifted[rows]
        if off.any():
            lifted = np.where(off[:, None], line, np.nan)
            self._line(lifted, f"lifted, up to {gap}", color=ORANGE, lw=4.5, marker="o", ms=2.5, zorder=5.5)
        kinds = (1, VERMILION, "contact pressure"), (-1, PURPLE, "contact tension")
        for sign, colour, words in kinds:
            values = np.maximum(sign * np.nan_to_num(part.pressure[rows]), 0.0) / (float(np.abs(stress).max()) or 1.0)
            if values.max() > NOTHING:
                self._profile(base, outward, values, shape.body.size, sign, colour)
                most = quantity(float((sign * stress).max()), "Pa")
                self.key(Patch(fc=colour, alpha=0.5, ec=colour, label=f"{words}, up to {most}"))

    def _line(self, points: Array, words: str, **look: Any) -> None:
        """A line along a part, with its words in the legend."""
        self.axes.plot(*points.T, **_ALONG, **look)
        self.key(Line2D([], [], label=words, **look))

    def _profile(self, base: Array, outward: Array, values: Array, size: float, sign: int, colour: str) -> None:
        """Values along a line as an area beside it, with arrows onto the line; from it where the sign is negative."""
        tips = base + ARROW * size * values[:, None] * outward
        self.axes.add_patch(Polygon(np.concatenate([base, tips[::-1]]), color=colour, alpha=0.16, lw=0, clip_on=False))
        shown = np.where(np.convolve(values > NOTHING, [1, 1, 1])[1:-1, None] > 0, tips, np.nan)
        self.axes.plot(*shown.T, color=colour, lw=1.8, zorder=5, path_effects=_HALO, clip_on=False)
        at = _spread(base, values, size, fewest=5)
        feet, ends = _at(base, base, at), _at(base, tips, at)
        self._arrows(ends if sign > 0 else feet, sign * (feet - ends), colour)
        self.reached.append(tips)

    def ghost(self, body: BodyMesh, points: Array, ways: Array) -> None:
        """Draw a body where a motion brings it, and the ways of some of its points.

        Args:
            body: the body.
            points: its points there, m, (n, 3).
            ways: m, (j, k, 3).
        """
        self._outline(points, body.outline, ec=VERMILION, lw=2, ls=(0, (5, 3)), zorder=4)
        self._outline(points, body.outline, fc=VERMILION, alpha=0.12, zorder=3)
        self.follow(ways[:, :, :2])

    def finish(self) -> Figure:
        """Lay out the picture and write its labels; the figure."""
        self.lay_out()
        self.write()
        return self.fig


def _lengths(line: Array) -> Array:
    """The way along a line to each of its points."""
    return np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])


def _at(line: Array, values: Array, at: Array) -> Array:
    """Values (m, k) at points on a line, interpolated at lengths along it."""
    s = _lengths(line)
    return np.column_stack([np.interp(at, s, column) for column in values.T])


def _spread(
    line: Array, amount: Array, size: float, *, apart: float = 0.0, long: float = 0.0, fewest: int = 2
) -> Array:
    """Where to put arrows on a line, as lengths along it, where there is something to show: nine on the body's size.

    Args:
        line: its points, m, (m, 2).
        amount: how much there is at them, (m,).
        size: of the body, m.
        apart: the least way between two, m; one alone stands in the middle.
        long: how far each reaches along the line, m.
        fewest: where they may stand as near as they like.
    """
    s = _lengths(line)
    there = (amount > 0.02 * amount.max()).astype(np.float64)
    start, end = s[there > 0.0][0] + long / 2, s[there > 0.0][-1] - long / 2
    count = max(fewest, round(9 * (end - start) / size))
    count = min(count, 1 + int(max(end - start, 0.0) / apart)) if apart else count
    places = np.linspace(start, end, count, dtype=np.float64) if count > 1 else np.array([(start + end) / 2])
    shown = places[np.interp(places, s, there) == 1.0]
    return shown if len(shown) else places
