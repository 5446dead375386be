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
from typing_extensions import override

from ...geometry import chains
from ...typing import Array, Integers, magnitude
from ..body_mesh import BodyMesh
from ..solution_arrays import NOTHING
from ..units import quantity
from .canvas import CONTACT, Canvas
from .shape import ARROW, TINTS, DeformedBody, HeldSide, PartGeometry, Region, Side, sparse
from .style import GREY, INK, ORANGE, PURPLE, VERMILION, fill

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
        self._fill(points, cells, np.repeat(values, 3) if by_cell else values, end or 1.0, colours)
        if len(cells) * shape.body.size**2 <= LEGIBLE * shape.body.volumes.sum():
            self.axes.triplot(*points.T, cells, color="white", lw=0.6, alpha=0.5, zorder=2)
        dashed: dict[str, Any] = {"ls": (0, (5, 4)), "lw": 1.3}
        self._outline(shape.at_rest, shape.body.outline, ec=GREY, zorder=3, **dashed)
        self._outline(points, shape.body.outline, ec=INK, lw=1.6, zorder=4)
        self.key(Line2D([], [], color=GREY, label="undeformed outline", **dashed))

    def _fill(self, points: Array, cells: Integers, values: Any, end: float, cmap: Colormap) -> None:
        """Fill cells in the colours of values by vertex, or by corner of each cell."""
        if len(values) == cells.size:
            points, cells = points[cells].reshape(-1, 2), np.arange(cells.size).reshape(-1, 3)
        x, y = points.T
        fill(self.axes, Triangulation(x, y, cells), values, (0.0, end), zorder=1, cmap=cmap)

    def show(self, shape: DeformedBody, areas: Sequence[Region]) -> None:
        """Draw the body at rest, its regions in their tints.

        Args:
            shape: the body.
            areas: its regions.
        """
        if areas:
            number = np.zeros(len(shape.body.cells))
            for i, area in enumerate(areas):
                number[area.cells] = i
            tints = ListedColormap([area.tint for area in areas])
            corners = np.repeat(number + 0.5, 3)
            self._fill(shape.at_rest[:, :2], shape.body.cells, corners, float(len(areas)), tints)
        self._outline(shape.at_rest, shape.body.outline, fc="none" if areas else TINTS[0], ec=INK, lw=1.6, zorder=1)

    def _outline(self, points: Array, loops: Sequence[Integers], *, fc: str = "none", **look: Any) -> None:
        """Draw closed chains as one path, holes included."""
        path = DrawnPath.make_compound_path(*(DrawnPath(points[loop, :2], closed=True) for loop in loops))
        self.axes.add_artist(PathPatch(path, fc=fc, joinstyle="round", **look))  # its limits are those reached
        self.reached.append(points[np.concatenate(loops), :2])

    @override
    def tint(self, shape: DeformedBody, side: Side, colour: str, words: str) -> None:
        if (colour, words) == CONTACT:
            self._line(shape.at_rest[side.vertices, :2], words, color=VERMILION, lw=5, zorder=2)

    @override
    def supports(self, shape: DeformedBody, found: Sequence[HeldSide]) -> None:
        off = ARROW / 6 * shape.body.size
        for support in found:
            line, outward = shape.points[support.side.vertices, :2], support.side.normals[:, :2]
            wall = line + support.rolling * off * outward
            strokes = TickedStroke(angle=-135, spacing=8, length=1.0, linewidth=0.9, foreground=GREY)
            self.axes.plot(*wall.T, color=INK, lw=2.2, zorder=3, path_effects=[strokes, Normal()], **_ALONG)
            self.reached.append(wall + off * outward)
            if not support.rolling:
                self.key(Patch(fc="white", ec=GREY, hatch="/////", lw=0.0, label="support"))
                continue
            rollers: dict[str, Any] = {"color": INK, "marker": "o", "mfc": "white"}
            places = ((line + wall) / 2)[sparse(line, 6 * off)]
            self.axes.plot(*places.T, ls="", ms=10, mew=1.2, clip_on=False, zorder=5, **rollers)
            self.key(Line2D([], [], lw=2.2, ms=7, label="support, free to slide", **rollers))

    @override
    def arrows(self, tails: Array, ways: Array) -> None:
        self.axes.quiver(
            *tails[:, :2].T, *ways[:, :2].T, color=INK, angles="xy", scale_units="xy", scale=1.0, units="inches",
            width=0.03, headwidth=4.2, headlength=4.6, headaxislength=4.4, minlength=0.1, clip_on=False, zorder=6,
            path_effects=_HALO,
        )  # fmt: skip
        self.key(Line2D([0, 1], [0, 0], color=INK, marker=">", ms=7, markevery=(1, 1), lw=1.6, label="load"))

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
            values = np.maximum(sign * np.nan_to_num(part.pressure[rows]), 0.0) / (magnitude(stress) or 1.0)
            if values.max() > NOTHING:
                self._profile(base, outward, values, shape.body.size, colour)
                most = quantity(float((sign * stress).max()), "Pa")
                self.key(Patch(fc=(colour, 0.5), ec=colour, label=f"{words}, up to {most}"))

    def _line(self, points: Array, words: str, **look: Any) -> None:
        """A line along a part, with its words in the legend."""
        self.axes.plot(*points.T, **_ALONG, **look)
        self.key(Line2D([], [], label=words, **look))

    def _profile(self, base: Array, outward: Array, values: Array, size: float, colour: str) -> None:
        """Values along a line as an area beside it."""
        tips = base + ARROW * size * values[:, None] * outward
        self.axes.add_patch(Polygon(np.concatenate([base, tips[::-1]]), color=colour, alpha=0.3, lw=0, clip_on=False))
        shown = np.where(np.convolve(values > NOTHING, [1, 1, 1])[1:-1, None] > 0, tips, np.nan)
        self.axes.plot(*shown.T, color=colour, lw=1.8, zorder=5, path_effects=_HALO, clip_on=False)
        self.reached.append(tips)

    def ghost(self, body: BodyMesh, points: Array, ways: Array) -> None:
        """Draw a body where a motion brings it, and the ways of some of its points.

        Args:
            body: the body.
            points: its points there, m, (n, 3).
            ways: from and to, m, (j, 2, 3).
        """
        self._outline(points, body.outline, ec=VERMILION, lw=2, ls=(0, (5, 3)), zorder=4)
        self._outline(points, body.outline, fc=VERMILION, alpha=0.12, zorder=3)
        self.follow(ways[:, :, :2])

    def finish(self) -> Figure:
        """Lay out the picture and write its labels; the figure."""
        self.lay_out()
        self.write()
        return self.fig
