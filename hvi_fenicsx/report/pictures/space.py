"""A body in space and what acts on it, drawn by pyvista and put into matplotlib's axes.

The projection is parallel, so that a point's place in the picture is two scalar products: letters, bars and arrows of
motion are matplotlib's, in the same letters as all other pictures. What hides what is pyvista's matter; the body is
seen from where its contact parts are seen best, from below where they are its underside.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyvista
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from typing_extensions import override

from ...typing import Array, Integers, magnitude
from ..body_mesh import BodyMesh
from ..reader import Result
from ..units import quantity, unit_for
from .canvas import Canvas
from .shape import TINTS, DeformedBody, PartGeometry, Region, Side
from .style import GREY, INK, PALE, VERMILION, pressure_scale

ELEVATIONS, AZIMUTHS = (22, -22), (-58, -122, 122, 58)
"""Degrees: from the front, the right and above, unless contact parts are seen better from elsewhere."""
SHARP = 35
"""Degrees: facets that turn by more have an edge between them."""
LEGIBLE = 5000
"""Facets up to which their edges are drawn."""


class SpaceCanvas(Canvas):
    """The canvas of a body in space."""

    def __init__(self, result: Result, subject: str, normals: Sequence[Array]) -> None:
        """Begin a picture.

        Args:
            result: whose body it is.
            subject: what the picture shows.
            normals: of the parts that are to be seen, as long as their areas, (3,).
        """
        super().__init__(result, subject)
        self.plotter = pyvista.Plotter(off_screen=True, border=False)
        views = [_view(azimuth, elevation) for elevation, azimuth in itertools.product(ELEVATIONS, AZIMUTHS)]
        seen = [sum(max(float(n @ toward), 0.0) for n in normals) for *_, toward in views]
        self.right, self.up, self.toward = views[int(np.argmax(np.round(seen, 6)))]
        self.nearer = 1e-3 * result.body.size * self.toward  # of two that share a face, this one is seen

    @override
    def project(self, points: Array) -> Array:
        return points @ np.column_stack([self.right, self.up])

    def _skin(
        self, rest: Array, points: Array, facets: Integers, *, width: int = 3, edges: str = INK, **look: Any
    ) -> None:
        """Put facets and their sharp edges into pyvista's scene; ``scalars`` are by facet, or by vertex of the body."""
        skin = _surface(points, facets)
        if len(look.get("scalars", ())) == len(points) != len(facets):
            look["scalars"] = look["scalars"][skin.point_data["vertex"]]
        self.plotter.add_mesh(skin, show_scalar_bar=False, **look)
        self.reached.append(self.project(np.asarray(skin.points)))
        self._edges(rest, points, facets, edges, width)

    def _edges(self, rest: Array, points: Array, facets: Integers, colour: str, width: int) -> None:
        """Put the edges of facets into pyvista's scene: where they turn sharply at rest, or end."""
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
        """Draw the deformed body over the undeformed one; cells are in the colours of the scale itself, without light.

        Args:
            shape: the deformed body.
            values: by vertex, (n,), or by cell, (c,).
            colours: of the values, from zero.
            end: the value at the end of the colours.
            by_cell: whether they are by cell.
        """
        body = shape.body
        look: dict[str, Any] = {"lighting": False} if by_cell else {"ambient": 0.6, "diffuse": 0.45}
        mesh = len(body.boundary) <= LEGIBLE and not by_cell
        self._skin(
            body.points, shape.points, body.boundary, scalars=values[body.behind] if by_cell else values, cmap=colours,
            clim=(0.0, end or 1.0), show_edges=mesh, edge_color="white", edge_opacity=0.4, line_width=1, **look,
        )  # fmt: skip
        self._edges(body.points, body.points, body.boundary, GREY, 2)
        self.reached.append(self.project(body.points[body.outermost]))

    def contacts(self, shape: DeformedBody, parts: Sequence[PartGeometry]) -> None:
        """The pressure on each part, with its scale.

        Args:
            shape: the body as it is drawn.
            parts: those with contact or a law.
        """
        if not parts:
            return
        values = np.nan_to_num(np.concatenate([geometry.part.pressure for geometry in parts]))
        colours, low, high = pressure_scale(float(values.min(initial=0.0)), magnitude(values))
        for geometry in parts:
            self._skin(
                shape.body.points, shape.points + self.nearer, geometry.facets, scalars=geometry.pressure, cmap=colours,
                clim=(low, high or 1.0), nan_color=PALE, lighting=False,
            )  # fmt: skip
        unit = unit_for(high, "Pa")
        words = f"contact pressure, up to {unit.text(high)}" if low == 0.0 else f"contact pressure in {unit.name}"
        gaps = [geometry.part.largest_gap for geometry in parts if geometry.part.idle.any()]
        words += f"; grey: lifted, up to {quantity(max(gaps), 'm')}" if gaps else ""
        self.bar(colours, low / unit.size, high / unit.size, words)

    def show(self, shape: DeformedBody, areas: Sequence[Region]) -> None:
        """Draw the body at rest, its regions in their tints.

        Args:
            shape: the body.
            areas: its regions.
        """
        body = shape.body
        owner = np.zeros(len(body.cells), dtype=np.int64)
        for number, area in enumerate(areas):
            owner[area.cells] = number
        for number, colour in enumerate([area.tint for area in areas] or TINTS[:1]):
            facets = body.boundary[owner[body.behind] == number]
            if len(facets):
                self._skin(body.points, body.points, facets, color=colour, ambient=0.75, diffuse=0.3)

    @override
    def tint(self, shape: DeformedBody, side: Side, colour: str, words: str) -> None:
        self._skin(
            shape.body.points, shape.body.points + self.nearer, side.facets, width=2, color=colour, lighting=False
        )
        self.key(Patch(fc=colour, ec=INK, label=words))

    @override
    def arrows(self, tails: Array, ways: Array) -> None:
        cloud = pyvista.PolyData(tails)
        cloud.point_data["way"] = ways
        arrow = pyvista.Arrow(tip_length=0.3, tip_radius=0.075, shaft_radius=0.022)
        self.plotter.add_mesh(cloud.glyph(orient="way", scale="way", geom=arrow), color=INK, lighting=False)

    def ghost(self, body: BodyMesh, points: Array, ways: Array) -> None:
        """Draw a body where a motion brings it, and the ways of some of its points but that farthest behind.

        Args:
            body: the body.
            points: its points there, m, (n, 3).
            ways: from and to, m, (j, 2, 3).
        """
        self._skin(
            body.points, points + self.nearer, body.boundary, width=4, edges=VERMILION, color=VERMILION, opacity=0.16,
            lighting=False,
        )  # fmt: skip
        depths = ways[:, 0] @ self.toward
        self.follow(np.array([self.project(way) for way in ways[np.argsort(depths)[len(ways) > 1 :]]]))

    def finish(self) -> Figure:
        """Lay out the picture and write its labels; the figure."""
        (left, bottom), (right, top) = self.extent()
        plotter, wide = self.plotter, right - left
        middle = self.right * (left + right) / 2 + self.up * (bottom + top) / 2
        try:
            plotter.window_size = [1600, max(1, round(1600 * (top - bottom) / wide))]
            plotter.camera_position = [middle + 10 * wide * self.toward, middle, self.up]
            plotter.enable_parallel_projection()  # type: ignore[call-arg]
            plotter.camera.parallel_scale = (top - bottom) / 2
            plotter.reset_camera_clipping_range()
            image = plotter.screenshot(transparent_background=True, return_img=True)
        finally:
            plotter.close()
        self.lay_out()
        self.axes.imshow(image, extent=(left, right, bottom, top), interpolation="antialiased", zorder=1)
        self._directions()
        self.write()
        return self.fig

    def _directions(self) -> None:
        """Say in a corner which way the coordinates grow."""
        corner = self.axes.inset_axes((0.0, 0.0, 0.17, 0.17), zorder=8)
        corner.set(xlim=(-1.3, 1.3), ylim=(-1.3, 1.3), aspect="equal")
        corner.set_axis_off()
        ways: Any = self.project(np.eye(3)).tolist()
        for name, way in zip("xyz", ways, strict=True):
            arrow = {"arrowstyle": "<|-", "color": GREY, "shrinkA": 0, "shrinkB": 0}
            corner.annotate(name, (0, 0), way, color=GREY, ha="center", va="center", size=11, arrowprops=arrow)


def _view(azimuth: float, elevation: float) -> tuple[Array, Array, Array]:
    """Unit vectors (3,) to the right in the picture, upwards, and towards the eye."""
    a, e = np.radians([azimuth, elevation])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return right, np.cross(toward, right), toward


def _surface(points: Array, facets: Integers) -> pyvista.PolyData:
    """Facets as pyvista's, without the points that none of them has; ``vertex`` is the number of each point."""
    used, index = np.unique(facets, return_inverse=True)
    skin = pyvista.PolyData.from_regular_faces(points[used], index.reshape(facets.shape))  # type: ignore[arg-type]
    skin.point_data["vertex"] = used
    skin.set_active_scalars(None)
    return skin
