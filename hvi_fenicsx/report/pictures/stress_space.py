"""``stress.png`` of a body in space: the von Mises stress of the cells at its surface, hidden contact parts apart."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...typing import Array, Integers
from ..reader import Result
from ..units import times
from ..vtu import Body
from . import vtk_loads
from .body_plane import canvas
from .body_space import Patched, guides, placed
from .deformed import Deformed, deform, footings, scale_of
from .loads_supports import loads
from .stress_plane import FIELD, bar
from .style import EMBER, GREY, INK, heading, save
from .vtk_view import area_vectors, best_view, creases, render, surface

if TYPE_CHECKING:
    import pyvista


def draw(path: Path, result: Result, body: Body) -> None:
    """Draw the deformed body with its loads, each cell in the colour of its stress."""
    parts, pulled = footings(result, body), loads(result, body)
    shape, values = deform(body, parts), body.by_cell[FIELD]
    normals = [area_vectors(body.points, foot.facets).sum(axis=0) for foot in parts]
    view = best_view(normals)
    apart = [p for p in map(partial(placed, shape, view), parts, normals) if p.away.any()]
    arrows = [vtk_loads.arrows(shape, load) for load in pulled]
    reached = [shape.points, body.points, *(p.points[p.foot.vertices] for p in apart)]
    everything = np.concatenate([*reached, *(end for tails, ways in arrows for end in (tails, tails + ways))])
    made, axes = canvas(view.project(everything))
    heading(made, result, "stress in the body")
    scale = scale_of(body, values)
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    render(axes, view, depths, partial(_fill, shape=shape, apart=apart, arrows=arrows, values=values, end=scale.end))
    vtk_loads.labels(axes, view, shape, pulled)
    for part in apart:
        guides(axes, view, shape, part)
    bar(made, scale, times(shape.factor))
    if apart:
        words = f"drawn apart: “{'”, “'.join(p.foot.part.name for p in apart)}”"
        made.text(0.53, 0.82 / made.get_figheight(), words, size=12.5, color=GREY)
    save(made, path)


def _fill(
    plotter: pyvista.Plotter,
    *,
    shape: Deformed,
    apart: list[Patched],
    arrows: list[tuple[Array, Array]],
    values: Array,
    end: float,
) -> None:
    body = shape.body
    _paint(plotter, shape.points, body.boundary, values[body.behind], end)
    plotter.add_mesh(creases(body.points, body.boundary), color=GREY, line_width=2)
    for part in apart:
        own = body.among(part.foot.vertices)
        _paint(plotter, part.points, body.boundary[own], values[body.behind[own]], end)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)


def _paint(plotter: pyvista.Plotter, points: Array, facets: Integers, values: Array, end: float) -> None:
    """Facets in the colours of the scale itself: no light changes them."""
    skin = surface(points, facets)
    skin.cell_data[FIELD] = values
    plotter.add_mesh(skin, scalars=FIELD, cmap=EMBER, clim=(0.0, end or 1.0), show_scalar_bar=False, lighting=False)
    plotter.add_mesh(creases(points, facets), color=INK, line_width=3)
