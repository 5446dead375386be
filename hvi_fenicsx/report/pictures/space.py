"""A body in space and what acts on it, drawn by VTK and put into matplotlib's axes.

The projection is parallel, so that a point's place in the picture is two scalar products: letters, bars and arrows of
motion are matplotlib's, in the same letters as all other pictures. What hides what is VTK's matter; a part that looks
away from the eye, as the underside does, is drawn apart, out along its normal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.transforms import ScaledTranslation

from ...typing import Array, Integers
from ..body_mesh import BodyMesh
from ..reader import Result
from ..units import quantity, unit_for
from .canvas import LETTERS, Canvas, Label, Scale
from .regions import Region
from .shape import DeformedBody, PartGeometry
from .sides import HeldSide, LoadedSide, Side
from .style import BLUE, GREY, INK, PALE, VERMILION, pressure_scale

ELEVATION, AZIMUTHS = 22, (-58, -122, 122, 58)
"""Degrees: from the front and the right, unless a contact part is seen better from elsewhere."""
SHARP = 35
"""Degrees: facets that turn by more have an edge between them."""
ARROW = 0.16
"""The longest arrow of a load, of the body's size."""
LEGIBLE = 5000
"""Facets up to which their edges are drawn."""
CONTACT, SUPPORT, LOADED = "#eea06d", "#9fb7c9", "#f3cf7a"


class SpaceCanvas(Canvas):
    """The canvas of a body in space."""

    def __init__(self, result: Result, subject: str, normals: Sequence[Array]) -> None:
        """Begin a picture.

        Args:
            result: whose body it is.
            subject: what the picture shows.
            normals: of the parts that are to be seen, (3,).
        """
        super().__init__(result, subject)
        self.plotter = pyvista.Plotter(off_screen=True, border=False)
        self._painted: dict[str, Any] = {}
        self._away: dict[str, Array] = {}
        self._names: list[tuple[str, Array]] = []
        self._depths: list[float] = []
        self._arrows: list[Array] = []
        views = [_view(azimuth) for azimuth in AZIMUTHS]
        seen = [sum(max(float(n @ toward), 0.0) for n in normals) for *_, toward in views]
        self.right, self.up, self.toward = views[int(np.argmax(np.round(seen, 6)))]

    def project(self, points: Array) -> Array:
        """Points (n, 3) in the picture's plane, (n, 2), m."""
        return np.asarray(points @ np.column_stack([self.right, self.up]))

    def _reach(self, points: Array) -> None:
        """Have the picture show points, m, (n, 3)."""
        self.reached.append(self.project(points))
        depths = points @ self.toward
        self._depths += [float(depths.min()), float(depths.max())]

    def _skin(self, points: Array, facets: Integers, **look: Any) -> None:
        """Put facets into VTK's scene; ``scalars`` are by facet, or by vertex of the body."""
        skin = _surface(points, facets)
        if len(look.get("scalars", ())) == len(points) != len(facets):
            look["scalars"] = look["scalars"][skin.point_data["vertex"]]
        self.plotter.add_mesh(skin, show_scalar_bar=False, **look)
        self._reach(np.asarray(skin.points))

    def _edges(self, rest: Array, points: Array, facets: Integers, colour: str, width: int) -> None:
        """Put the edges of facets into VTK's scene: where they turn sharply at rest, or end."""
        sharp = _surface(rest, facets).extract_feature_edges(
            SHARP, boundary_edges=True, feature_edges=True, non_manifold_edges=False, manifold_edges=False
        )
        if sharp.n_points:
            sharp.points = points[sharp.point_data["vertex"]]
            sharp.clear_data()
            self.plotter.add_mesh(sharp, color=colour, line_width=width)

    def paint(
        self, shape: DeformedBody, values: Array, colours: Colormap, end: float, *, by_cell: bool = False
    ) -> None:
        """Draw the deformed body over the edges of the undeformed one, in the colours of values.

        Args:
            shape: the deformed body.
            values: by vertex, (n,), or by cell, (c,); the latter in the colours of the scale itself, without light.
            colours: of the values, from zero.
            end: the value at the end of the colours.
            by_cell: whether they are by cell.
        """
        body = shape.body
        self._painted = {"cmap": colours, "clim": (0.0, end or 1.0)}
        if by_cell:
            self._painted |= {"values": values[body.behind], "lighting": False}
        light = {} if by_cell else {"ambient": 0.6, "diffuse": 0.45}
        look = {key: value for key, value in self._painted.items() if key != "values"}
        mesh = len(body.boundary) <= LEGIBLE and not by_cell
        self._skin(
            shape.points, body.boundary, scalars=self._painted.get("values", values), **look, **light,
            show_edges=mesh, edge_color="white", edge_opacity=0.4, line_width=1,
        )  # fmt: skip
        self._edges(body.points, shape.points, body.boundary, INK, 3)
        self._edges(body.points, body.points, body.boundary, GREY, 2)
        self._reach(body.points[body.outermost])

    def contacts(self, shape: DeformedBody, parts: Sequence[PartGeometry], *, pressure: bool) -> None:
        """The pressure on each part, with its scale; or, of parts that are hidden, what the body is painted with."""
        body, values = shape.body, [geometry.part.pressure for geometry in parts]
        largest = max((float(np.nanmax(np.abs(v), initial=0.0)) for v in values), default=0.0)
        lowest = min((float(np.nanmin(v, initial=0.0)) for v in values), default=0.0)
        colours, low, high = pressure_scale(lowest, largest)
        for geometry in parts:
            own = body.among(geometry.facets)
            facets, name = body.boundary[own], geometry.part.name
            away = self._clear(name, shape.points[geometry.part.vertices], body.mean_normal(facets))
            points = shape.points + (away if away.any() else 1e-3 * body.size * self.toward)
            if pressure:
                self._skin(
                    points, facets, scalars=geometry.pressure, cmap=colours, clim=(low, high or 1.0), nan_color=PALE,
                    lighting=False,
                )  # fmt: skip
            elif away.any():
                look = {key: value for key, value in self._painted.items() if key != "values"}
                self._skin(points, facets, scalars=self._painted["values"][own], **look)
            if pressure or away.any():
                self._edges(body.points, points, facets, INK, 3)
            self._guide(shape.points[geometry.part.vertices], away)
        apart = "”, “".join(name for name, away in self._away.items() if away.any())
        if pressure and parts:
            gaps = [geometry.part.largest_gap for geometry in parts if geometry.part.idle.any()]
            remark = (
                f"grey: lifted, up to {quantity(max(gaps), 'm')}" if gaps else f"“{apart}” drawn apart" if apart else ""
            )
            unit = unit_for(high, "Pa")
            words = f"contact pressure, up to {unit.text(high)}" if low == 0.0 else f"contact pressure in {unit.name}"
            self.scales.append(Scale(colours, low / unit.size, high / unit.size, words, remark))
        elif apart:
            self.key(Line2D([], [], color="none", label=f"drawn apart: “{apart}”"))

    def _clear(self, part: str, points: Array, normal: Array) -> Array:
        """How far out along its normal a part is drawn, m, (3,): not at all where it is seen, or closes on itself."""
        across = self.project(normal[None])[0]
        length = float(np.linalg.norm(across))
        away: Array = np.zeros(3)
        if float(normal @ self.toward) < 0.15 and length > 0.1:
            ends, own = np.concatenate(self.reached) @ across / length, self.project(points) @ across / length
            margin = 0.05 * float(np.ptp(np.concatenate(self.reached), axis=0).max())
            away = (float(ends.max() - own.min()) + margin) / length * normal
        self._away[part] = away
        return away

    def _guide(self, points: Array, away: Array) -> None:
        """Thin lines from a part to where it is drawn apart, at its outermost points."""
        if away.any():
            start, way = self.project(points), self.project(away[None])[0]
            across = start @ np.array([-way[1], way[0]])
            for at in (start[np.argmin(across)], start[np.argmax(across)]):
                self.axes.plot(*np.array([at, at + way]).T, color=GREY, lw=1.1, ls=(0, (2, 3)), zorder=0.5)

    def show(self, shape: DeformedBody, areas: Sequence[Region], fill: str) -> None:
        """Draw the body at rest, its regions in their tints.

        Args:
            shape: the body.
            areas: its regions.
            fill: the colour of a body without regions.
        """
        body = shape.body
        skins = [(body.boundary[np.isin(body.behind, area.cells)], area.tint) for area in areas]
        for facets, colour in skins or [(body.boundary, fill)]:
            if len(facets):
                self._skin(body.points, facets, color=colour, ambient=0.75, diffuse=0.3)
        self._edges(body.points, body.points, body.boundary, INK, 3)

    def sides(self, shape: DeformedBody, sides: Sequence[Side], contacts: Sequence[str], held: Sequence[str]) -> None:
        """Name the parts, and colour them by what acts on them."""
        body = shape.body
        words = {CONTACT: "contact, friction or adhesion", SUPPORT: "support", LOADED: "loaded"}
        for side in sides:
            colour = CONTACT if side.part in contacts else SUPPORT if side.part in held else LOADED
            away = self._clear(side.part, body.points[side.vertices], body.mean_normal(side.facets))
            points = body.points + away + 1e-3 * body.size * self.toward
            self._skin(points, side.facets, color=colour, lighting=False)
            self._edges(body.points, points, side.facets, INK, 2)
            self._names.append((side.part, points[side.vertices]))
            self.key(Patch(fc=colour, ec=INK, label=words[colour]))
        if any(away.any() for away in self._away.values()):
            self.key(Line2D([], [], color="none", label="hidden parts are drawn apart"))

    def supports(self, shape: DeformedBody, found: Sequence[HeldSide]) -> None:
        """Nothing: a picture of the scene colours them, others leave them out."""

    def loads(self, shape: DeformedBody, found: Sequence[LoadedSide]) -> None:
        """Arrows onto a side where it is pushed, from it where it is pulled, off it where they are along it."""
        size = shape.body.size
        for load in found:
            chosen = _sparse(shape.body.points[load.side.vertices], size)
            chosen = chosen[np.linalg.norm(load.traction[chosen], axis=1) > load.largest / 8]
            ways, normals = load.traction[chosen] * ARROW * size / load.largest, load.side.normals[chosen]
            feet = shape.points[load.side.vertices[chosen]] + self._away.get(load.side.part, np.zeros(3))
            pushed = np.einsum("ki,ki->k", ways, normals) < 0.0
            tails = feet - np.where(pushed[:, None], ways, 0.0)
            beside = load.sheared[chosen]
            tails[beside] = (feet + ARROW / 5 * size * normals - ways / 2)[beside]
            cloud = pyvista.PolyData(tails)
            cloud.point_data["way"] = ways
            arrow = pyvista.Arrow(tip_length=0.3, tip_radius=0.075, shaft_radius=0.022)
            self.plotter.add_mesh(cloud.glyph(orient="way", scale="way", geom=arrow), color=INK, lighting=False)
            ends = np.concatenate([tails, tails + ways])
            self._reach(ends)
            self._arrows += [self.project(tails + part * ways) for part in np.linspace(0.0, 1.0, 9)]
            flat = self.project(ends)
            self.labels.append(Label(load.value, flat[np.argmax(flat[:, 1])], np.array([0.0, 1.0])))

    def ghost(self, body: BodyMesh, points: Array, ways: Array) -> None:
        """Draw a body where a motion brings it, and the ways of some points, (j, k, 3), but of the one behind it."""
        nearer = points + 1e-3 * body.size * self.toward  # where the two share a face, the ghost's is seen
        self._skin(nearer, body.boundary, color=VERMILION, opacity=0.16, lighting=False)
        self._edges(body.points, nearer, body.boundary, VERMILION, 4)
        depths = ways[:, 0] @ self.toward
        shown = [way for way, depth in zip(ways, depths, strict=True) if depth > depths.min() or len(ways) == 1]
        self._depths += [float((ways @ self.toward).min()), float((ways @ self.toward).max())]
        self.follow(np.array([self.project(np.asarray(way)) for way in shown]))

    def finish(self) -> Figure:
        """Lay out the picture, have VTK draw it, and write its labels."""
        self.lay_out()
        (left, right), (bottom, top) = self.axes.get_xlim(), self.axes.get_ylim()
        box, plotter = self.axes.get_window_extent(), self.plotter
        try:
            plotter.window_size = [round(1.5 * box.width), round(1.5 * box.height)]
            middle = self.right * (left + right) / 2 + self.up * (bottom + top) / 2
            far = max(self._depths) - min(self._depths) + right - left
            plotter.camera_position = [middle + self.toward * (max(self._depths) + far), middle, self.up]
            plotter.enable_parallel_projection()
            plotter.camera.parallel_scale = (top - bottom) / 2
            plotter.camera.clipping_range = (far / 2, 3 * far)
            image = plotter.screenshot(transparent_background=True, return_img=True)
            if self._names:
                self._name(np.array([left, bottom]), np.array([right - left, top - bottom]), max(self._depths) + far)
        finally:
            plotter.close()
        self.axes.imshow(image, extent=(left, right, bottom, top), aspect="auto", interpolation="antialiased", zorder=1)
        self._directions()
        self.write(np.concatenate([np.zeros((0, 2)), *self._arrows]))
        return self.fig

    def _directions(self) -> None:
        """Say in a corner which way the coordinates grow."""
        ends = self.project(np.eye(3)) * LETTERS * 2.2
        origin = 0.8 * LETTERS - np.minimum(ends.min(axis=0), 0.0)
        arrow = {
            "arrowstyle": "<|-,head_length=0.35,head_width=0.15",
            "color": GREY,
            "lw": 1.3,
            "shrinkA": 0,
            "shrinkB": 0,
        }
        foot = self.axes.transAxes + ScaledTranslation(origin[0] / 72, origin[1] / 72, self.fig.dpi_scale_trans)
        for name, right, up in zip("xyz", map(float, ends[:, 0]), map(float, ends[:, 1]), strict=True):
            self.axes.annotate(
                name, (0, 0), (right, up), xycoords=foot, textcoords="offset points", ha="center",
                va="center", size=LETTERS, color=GREY, arrowprops=arrow,
            )  # fmt: skip

    def _name(self, low: Array, extent: Array, eye: float) -> None:
        """A label for each part, at the vertex nearest to the middle of those that VTK has not hidden."""
        depth = self.plotter.get_image_depth(fill_value=np.nan)
        for name, points in self._names:
            flat = self.project(points)
            pixel = ((flat - low) / extent * [depth.shape[1], depth.shape[0]]).astype(int)
            found = depth[::-1][np.clip(pixel[:, 1], 0, len(depth) - 1), np.clip(pixel[:, 0], 0, depth.shape[1] - 1)]
            behind = (eye - points @ self.toward) + found  # VTK counts from the eye, downwards
            seen = np.abs(np.nan_to_num(behind)) < 0.01 * extent.max()
            shown = flat[seen] if seen.any() else flat
            at = shown[np.argmin(np.linalg.norm(shown - shown.mean(axis=0), axis=1))]
            self.labels.insert(0, Label(name, at, np.zeros(2), BLUE))


def _view(azimuth: float) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) to the right in the picture, upwards, and towards the eye."""
    a, e = np.radians([azimuth, ELEVATION])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return right, np.cross(toward, right), toward


def _surface(points: Array, facets: Integers) -> pyvista.PolyData:
    """Facets as VTK's, without the points that none of them has; ``vertex`` is the number of each point."""
    used, index = np.unique(facets, return_inverse=True)
    skin = pyvista.PolyData.from_regular_faces(points[used], index.reshape(facets.shape))
    skin.point_data["vertex"] = used
    skin.set_active_scalars(None)
    return skin


def _sparse(points: Array, size: float) -> Integers:
    """One point of a face near each node of a coarse grid, which has one node, in the middle, across a narrow face."""
    extent = np.ptp(points, axis=0)
    cells = np.round(extent / (0.25 * size))
    part = (points - points.min(axis=0)) / np.where(extent > 1e-9 * size, extent, np.inf)
    place = np.where(cells > 0.0, part * cells, np.where(extent > 1e-9 * size, part - 0.5, 0.0))
    node = np.round(place)
    distance = np.round(np.linalg.norm(place - node, axis=1), 6)
    order = np.lexsort((*np.round(place, 6).T[::-1], distance))
    return np.asarray(order[np.unique(node[order], axis=0, return_index=True)[1]])
