"""Bodies in space drawn by VTK: where it is seen from, and its picture put into matplotlib's axes.

The projection is parallel, so that a point's place in the picture is two scalar products: letters, bars and arrows of
motion are matplotlib's, in the same letters as all other pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes

from ...typing import Array, Integers

if TYPE_CHECKING:
    import pyvista

ELEVATION = 22.0
AZIMUTHS = (-58.0, -122.0, 122.0, 58.0)
"""Degrees: from the front and the right, unless a contact part is seen better from elsewhere."""
SHARPER = 1.6
"""Pixels rendered for one drawn, along each side."""


@dataclass(frozen=True)
class View:
    """From where a body is seen: three orthonormal vectors (3,).

    Attributes:
        right: what is to the right in the picture.
        up: what is up in the picture.
        toward: what comes towards the eye.
    """

    right: Array
    up: Array
    toward: Array

    def project(self, points: Array) -> Array:
        """Points (n, 3) in the picture's plane, (n, 2), m."""
        return np.asarray(points @ np.column_stack([self.right, self.up]))

    def depth(self, points: Array) -> Array:
        """How near points are to the eye."""
        return np.asarray(points @ self.toward)


def _view(azimuth: float) -> View:
    a, e = np.radians(azimuth), np.radians(ELEVATION)
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return View(right, np.cross(toward, right), toward)


def best_view(normals: Sequence[Array]) -> View:
    """The view that looks most at parts with these outward normals."""
    views = [_view(azimuth) for azimuth in AZIMUTHS]
    seen = [sum(max(float(n @ view.toward), 0.0) for n in normals) for view in views]
    return views[int(np.argmax(np.round(seen, 6)))]


def area_vectors(points: Array, facets: Integers) -> Array:
    """Outward normals (k, 3) of facets, as long as their areas.

    Args:
        points: m, (n, 3).
        facets: counterclockwise seen from outside, (k, 3).
    """
    corner = points[facets[:, 0]]
    normals = np.cross(points[facets[:, 1]] - corner, points[facets[:, 2]] - corner)
    return np.asarray(normals / 2.0, dtype=np.float64)


def surface(points: Array, facets: Integers) -> pyvista.PolyData:
    """Facets as VTK's, without the points that none of them has; ``vertex`` is the number of each point.

    Args:
        points: m, (n, 3).
        facets: (k, 3).
    """
    import pyvista

    used, index = np.unique(facets, return_inverse=True)
    fig = pyvista.PolyData.from_regular_faces(points[used], index.reshape(facets.shape))
    fig.point_data["vertex"] = used
    return fig


def draw_edges(plotter: pyvista.Plotter, points: Array, edges: Integers, colour: str, width: float) -> None:
    """Put edges into VTK's scene; a ball has none.

    Args:
        plotter: that draws it.
        points: m, (n, 3).
        edges: (k, 2).
        colour: of the lines.
        width: of the lines, pixels.
    """
    import pyvista

    if len(edges):
        ends = np.insert(np.arange(2 * len(edges)).reshape(-1, 2), 0, 2, axis=1)
        plotter.add_mesh(pyvista.PolyData(points[edges.ravel()], lines=ends.ravel()), color=colour, line_width=width)


def render(axes: Axes, view: View, depths: tuple[float, float], fill: Callable[[pyvista.Plotter], None]) -> None:
    """Draw a scene of VTK's into axes, at their scale.

    Args:
        axes: to draw on.
        view: from where the scene is seen.
        depths: of its farthest and its nearest point along the view, m.
        fill: puts what is drawn into the scene.
    """
    import pyvista

    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    box = axes.get_window_extent()
    size = (round(box.width * SHARPER), round(box.height * SHARPER))
    plotter = pyvista.Plotter(off_screen=True, window_size=size, border=False)
    try:
        plotter.set_background("white")
        fill(plotter)
        middle = view.right * (left + right) / 2 + view.up * (bottom + top) / 2
        reach = (depths[1] - depths[0]) + (right - left)
        plotter.camera_position = [middle + view.toward * (depths[1] + reach), middle, view.up]
        plotter.enable_parallel_projection()
        plotter.camera.parallel_scale = (top - bottom) / 2
        plotter.camera.clipping_range = (0.5 * reach, 3.0 * reach)
        image = plotter.screenshot(transparent_background=True, return_img=True)
    finally:
        plotter.close()
    axes.imshow(image, extent=(left, right, bottom, top), aspect="auto", interpolation="antialiased", zorder=1)
