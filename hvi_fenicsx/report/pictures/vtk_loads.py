"""Loads on the sides of a body in space: arrows that VTK draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...typing import Array, Integers
from .deformed import DeformedBody
from .loads_supports import LoadedSide
from .plane_marks import OFF
from .style import INK

if TYPE_CHECKING:
    import pyvista

ARROW = 0.16
"""The longest, of the body's size."""


def fill(plotter: pyvista.Plotter, tails: Array, ways: Array) -> None:
    """Put arrows into VTK's scene.

    Args:
        plotter: that draws it.
        tails: where the arrows begin, m, (k, 3).
        ways: from there to their tips, m, (k, 3).
    """
    import pyvista

    cloud = pyvista.PolyData(tails)
    cloud.point_data["way"] = ways
    shaft = pyvista.Arrow(tip_length=0.3, tip_radius=0.075, shaft_radius=0.022, tip_resolution=16, shaft_resolution=10)
    plotter.add_mesh(cloud.glyph(orient="way", scale="way", geom=shaft), color=INK, lighting=False)


def arrows(shape: DeformedBody, load: LoadedSide) -> tuple[Array, Array]:
    """The arrows of a load: onto the side where it is pushed, from it where it is pulled, off it along it.

    Args:
        shape: the deformed body.
        load: the load.

    Returns:
        Where they begin, m, (k, 3), and the way from there to their tips, m, (k, 3).
    """
    chosen = _sparse(shape.body.points[load.side.vertices], shape.body.size)
    traction = load.traction[chosen]
    ways = traction * ARROW * shape.body.size / load.largest
    feet = shape.points[load.side.vertices[chosen]]
    visible = np.linalg.norm(ways, axis=1) > 0.02 * shape.body.size
    normals, beside = load.side.normals[chosen], load.sheared[chosen]
    pushed = np.einsum("ki,ki->k", ways, normals) < 0.0
    tails = feet - np.where(pushed[:, None], ways, 0.0)
    tails[beside] = (feet + OFF * shape.body.size * normals - ways / 2)[beside]
    return tails[visible], ways[visible]


def _sparse(points: Array, size: float) -> Integers:
    """One point of a face near each node of a coarse grid; of equally near ones that with the smallest coordinates."""
    low = points.min(axis=0)
    extent = np.ptp(points, axis=0)
    flat = extent < 1e-9 * size
    cells = np.where(flat, 0.0, np.maximum(np.round(extent / (0.25 * size)), 1.0))
    place = (points - low) / np.where(flat, 1.0, extent) * cells
    node = np.round(place)
    distance = np.round(np.linalg.norm(place - node, axis=1), 6)
    order = np.lexsort((*np.round(place, 6).T[::-1], distance))
    return np.asarray(order[np.unique(node[order], axis=0, return_index=True)[1]])
