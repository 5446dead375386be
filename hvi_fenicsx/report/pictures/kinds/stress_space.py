"""``stress.png`` of a body in space: the von Mises stress of the cells at its surface, hidden contact parts apart."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from ....typing import Array, Integers
from ...reader import Result
from ...units import times
from .. import vtk_loads
from ..creases import creases
from ..deformed import DeformedBody, deform, part_geometries
from ..footprints import Footprint, footprints, guides
from ..load_labels import labels, reaches
from ..loads_supports import borne_loads
from ..registry import picture
from ..space_canvas import space_canvas
from ..stress_scale import bar, scale_of
from ..style import EMBER, GREY, INK, heading
from ..vtk_view import area_vectors, best_view, draw_edges, render, surface

if TYPE_CHECKING:
    import pyvista


@picture(
    "stress",
    dimension=3,
    rendered=True,
    caption="Stress in the body (von Mises), constant in each cell; the scale may end below a peak in a corner.",
    wanted=lambda result: result.body.von_mises is not None,
)
def draw(result: Result) -> Figure:
    """Draw the deformed body with its loads, each cell in the colour of its stress."""
    body, parts, pulled = result.body, part_geometries(result), borne_loads(result)
    assert body.von_mises is not None
    shape, values = deform(body, parts), body.von_mises
    normals = [area_vectors(body.points, geometry.facets).sum(axis=0) for geometry in parts]
    view = best_view(normals)
    apart = [patch for patch in footprints(shape, view, parts, normals) if patch.away.any()]
    arrows = [vtk_loads.arrows(shape, load) for load in pulled]
    reached = [
        shape.points[body.outermost],
        body.points[body.outermost],
        *(p.points[p.geometry.vertices] for p in apart),
    ]
    everything = np.concatenate([*reached, *(end for tails, ways in arrows for end in (tails, tails + ways))])
    found = labels(view, reached, pulled, arrows)
    fig, axes = space_canvas(view, [*reaches(view, np.concatenate(reached), arrows), *(label.reach for label in found)])
    heading(fig, result, "stress in the body")
    scale = scale_of(body, values)
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    render(axes, view, depths, partial(_fill, shape=shape, apart=apart, arrows=arrows, values=values, end=scale.end))
    for label in found:
        label.draw(axes)
    for part in apart:
        guides(axes, view, shape, part)
    bar(fig, scale, times(shape.factor))
    if apart:
        words = f"drawn apart: “{'”, “'.join(p.geometry.part.name for p in apart)}”"
        fig.text(0.53, 0.82 / fig.get_figheight(), words, size=12.5, color=GREY)
    return fig


def _fill(
    plotter: pyvista.Plotter,
    *,
    shape: DeformedBody,
    apart: list[Footprint],
    arrows: list[tuple[Array, Array]],
    values: Array,
    end: float,
) -> None:
    body = shape.body
    edges = creases(body.points, body.boundary)
    _paint(plotter, shape.points, body.boundary, values[body.behind], end)
    draw_edges(plotter, shape.points, edges, INK, 3)
    draw_edges(plotter, body.points, edges, GREY, 2)
    for part in apart:
        own = body.among(part.geometry.facets)
        _paint(plotter, part.points, body.boundary[own], values[body.behind[own]], end)
        draw_edges(plotter, part.points, creases(body.points, body.boundary[own]), INK, 3)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)


def _paint(plotter: pyvista.Plotter, points: Array, facets: Integers, values: Array, end: float) -> None:
    """Facets in the colours of the scale itself: no light changes them."""
    skin = surface(points, facets)
    skin.cell_data["von_mises"] = values
    plotter.add_mesh(
        skin, scalars="von_mises", cmap=EMBER, clim=(0.0, end or 1.0), show_scalar_bar=False, lighting=False
    )
