"""``body.png`` of a body in space: deformed over its edges, |u| on it, contact pressure on its parts."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.colors import Colormap
from matplotlib.figure import Figure

from ....typing import Array, Integers
from ...reader import Result
from ...units import quantity, times, unit_for
from .. import vtk_loads
from ..creases import creases
from ..deformed import DeformedBody, PartGeometry, deform, largest_stress, part_geometries
from ..footprints import Footprint, footprints, guides
from ..legend import colour_bar
from ..load_labels import labels, reaches
from ..loads_supports import borne_loads
from ..registry import picture
from ..space_canvas import space_canvas
from ..style import GREY, INK, PALE, SLATE, heading, pressure_scale
from ..vtk_view import area_vectors, best_view, draw_edges, render, surface

if TYPE_CHECKING:
    import pyvista

LEGIBLE = 5000
"""Facets up to which their edges are drawn."""


@picture(
    "body",
    dimension=3,
    rendered=True,
    caption="The deformed body, its displacements magnified, with what acts on it.",
    wanted=lambda result: result.body.displacement is not None,
)
def draw(result: Result) -> Figure:
    """Draw the body with its loads and contact parts."""
    body, parts, pulled = result.body, part_geometries(result), borne_loads(result)
    shape = deform(body, parts)
    normals = [area_vectors(body.points, geometry.facets).sum(axis=0) for geometry in parts]
    view = best_view(normals)
    shown = footprints(shape, view, parts, normals)
    arrows = [vtk_loads.arrows(shape, load) for load in pulled]
    reached = [
        shape.points[body.outermost],
        body.points[body.outermost],
        *(s.points[s.geometry.vertices] for s in shown),
    ]
    everything = np.concatenate([*reached, *(end for tails, ways in arrows for end in (tails, tails + ways))])
    found = labels(view, reached, pulled, arrows)
    fig, axes = space_canvas(view, [*reaches(view, np.concatenate(reached), arrows), *(label.reach for label in found)])
    heading(fig, result, "deformed body")
    scale = pressure_scale(_lowest(parts), largest_stress(parts))
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    render(axes, view, depths, partial(_fill, shape=shape, shown=shown, arrows=arrows, scale=scale))
    for label in found:
        label.draw(axes)
    for patch in shown:
        guides(axes, view, shape, patch)
    _foot(fig, shape, shown, scale)
    return fig


def _fill(
    plotter: pyvista.Plotter,
    *,
    shape: DeformedBody,
    shown: list[Footprint],
    arrows: list[tuple[Array, Array]],
    scale: tuple[Colormap, float, float],
) -> None:
    facets = shape.body.boundary
    skin = surface(shape.points, facets)
    skin.point_data["amount"] = shape.amount[skin.point_data["vertex"]]
    plotter.add_mesh(
        skin,
        scalars="amount",
        cmap=SLATE,
        clim=(0.0, float(shape.amount.max()) or 1.0),
        show_edges=len(facets) <= LEGIBLE,
        edge_color="white",
        edge_opacity=0.4,
        line_width=1,
        ambient=0.6,
        diffuse=0.45,
        show_scalar_bar=False,
    )
    edges = creases(shape.body.points, facets)
    draw_edges(plotter, shape.points, edges, INK, 3)
    draw_edges(plotter, shape.body.points, edges, GREY, 2)
    for part in shown:
        _fill_part(plotter, part, creases(shape.body.points, part.geometry.facets), scale)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)


def _fill_part(
    plotter: pyvista.Plotter, part: Footprint, edges: Integers, scale: tuple[Colormap, float, float]
) -> None:
    patch = surface(part.points, part.geometry.facets)
    patch.point_data["pressure"] = part.pressure[patch.point_data["vertex"]]
    plotter.add_mesh(
        patch,
        scalars="pressure",
        cmap=scale[0],
        clim=(scale[1], scale[2] or 1.0),
        nan_color=PALE,
        show_scalar_bar=False,
        lighting=False,
    )
    draw_edges(plotter, part.points, edges, INK, 3)


def _lowest(parts: list[PartGeometry]) -> float:
    return min((float(np.nanmin(geometry.part.pressure)) for geometry in parts), default=0.0)


def _foot(fig: Figure, shape: DeformedBody, shown: list[Footprint], scale: tuple[Colormap, float, float]) -> None:
    most = float(shape.amount.max())
    unit = unit_for(most, "m")
    words = f"displacement |u|, up to {unit.text(most)}"
    colour_bar(fig, SLATE, (0.0, most / unit.size), words, times(shape.factor))
    if shown:
        colours, low, high = scale
        unit = unit_for(high, "Pa")
        words = f"contact pressure, up to {unit.text(high)}" if low == 0.0 else f"contact pressure in {unit.name}"
        colour_bar(fig, colours, (low / unit.size, high / unit.size), words, _remark(shown), at=3.75)


def _remark(shown: list[Footprint]) -> str:
    """Where the footprints are, and what grey means on them."""
    gaps = [s.geometry.part.largest_gap for s in shown if s.geometry.part.idle.any()]
    lifted = [f"grey: lifted, up to {quantity(max(gaps), 'm')}"] if gaps else []
    away = [s.geometry.part.name for s in shown if s.away.any()]
    return lifted[0] if lifted else f"“{'”, “'.join(away)}” drawn apart" if away else ""
