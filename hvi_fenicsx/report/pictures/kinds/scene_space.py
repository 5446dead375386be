"""``scene.png`` of a body in space: its loads, and its parts coloured by what acts on them, the hidden ones apart."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from ....typing import Array
from ...body_mesh import BodyMesh
from ...reader import Result
from .. import apart, vtk_loads
from ..creases import creases
from ..deformed import DeformedBody
from ..legend import legend
from ..load_labels import labels, reaches
from ..loads_supports import LoadedSide, Side, held_sides, loaded_sides, roles_by_side
from ..regions import Region, regions
from ..regions import keys as region_keys
from ..registry import picture
from ..scene_legend import inside, say, touches
from ..seen import Surface
from ..space_canvas import space_canvas
from ..space_names import names
from ..style import INK, PALE, heading
from ..vtk_view import area_vectors, best_view, draw_edges, render, surface

if TYPE_CHECKING:
    import pyvista

CONTACT, SUPPORT, LOADED = "#eea06d", "#9fb7c9", "#f3cf7a"


@dataclass(frozen=True)
class ColouredSide:
    """A side as it is drawn.

    Attributes:
        side: the side.
        colour: by what acts on it.
        away: how far it is moved, m, (3,).
    """

    side: Side
    colour: str
    away: Array


@picture(
    "scene",
    dimension=3,
    rendered=True,
    caption="The scene: the undeformed body with its supports, loads and contact parts.",
    wanted=lambda result: bool(result.sides),
)
def draw(result: Result) -> Figure:
    """Draw the scene of a body in space."""
    body = result.body
    rest, pulled = DeformedBody(body, np.zeros_like(body.points), 1.0), loaded_sides(result)
    found = list(roles_by_side(result))
    view = best_view([area_vectors(body.points, side.facets).sum(axis=0) for side, roles in found if touches(roles)])
    held = {support.side.part for support in held_sides(result)}
    colours = [CONTACT if touches(t) else SUPPORT if s.part in held else LOADED for s, t in found]
    sides = [side for side, _ in found]
    ways = apart.ways(
        view, body.points[body.outermost], ((body.points[s.vertices], s.normal) for s in sides), 0.05 * body.size
    )
    shown = [ColouredSide(s, c, way) for s, c, way in zip(sides, colours, ways, strict=True)]
    arrows = _arrows(rest, pulled, shown)
    reached = [body.points[body.outermost], *(body.points[s.side.vertices] + s.away for s in shown)]
    everything = np.concatenate([*reached, *(end for tails, ways in arrows for end in (tails, tails + ways))])
    drawn = [(s.side.part, Surface(points=body.points + s.away, facets=s.side.facets)) for s in shown]
    written = names(view, Surface(points=body.points, facets=body.boundary), drawn, arrows)
    values = labels(view, reached, pulled, arrows, [name.reach for name in written])
    words = [*written, *values]
    fig, axes = space_canvas(view, [*reaches(view, np.concatenate(reached), arrows), *(one.reach for one in words)])
    heading(fig, result, "the scene")
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    areas = regions(result)
    fill = partial(_fill, body=body, areas=areas, shown=shown, arrows=arrows, toward=view.toward)
    render(axes, view, depths, fill)
    for one in words:
        one.draw(axes)
    say(fig, body)
    legend(fig, [*keys(shown), *region_keys(areas), *_apart(shown), *inside(result)])
    return fig


def keys(shown: list[ColouredSide]) -> list[Artist]:
    """What the colours mean that are there."""
    words = {CONTACT: "contact, friction or adhesion", SUPPORT: "support", LOADED: "loaded"}
    return [Patch(fc=c, ec=INK, label=w) for c, w in words.items() if c in {s.colour for s in shown}]


def _arrows(rest: DeformedBody, pulled: list[LoadedSide], shown: list[ColouredSide]) -> list[tuple[Array, Array]]:
    """The arrows of each load, where its part is drawn."""
    away = {s.side.part: s.away for s in shown}
    found = [(away[load.side.part], *vtk_loads.arrows(rest, load)) for load in pulled]
    return [(tails + moved, ways) for moved, tails, ways in found]


def _apart(shown: list[ColouredSide]) -> list[Artist]:
    """The legend's line on parts that are not drawn on the body."""
    moved = any(s.away.any() for s in shown)
    return [Line2D([], [], color="none", label="hidden parts are drawn apart")] if moved else []


def _fill(
    plotter: pyvista.Plotter,
    *,
    body: BodyMesh,
    areas: list[Region],
    shown: list[ColouredSide],
    arrows: list[tuple[Array, Array]],
    toward: Array,
) -> None:
    skins = [(body.boundary[np.isin(body.behind, area.cells)], area.tint) for area in areas]
    for facets, colour in skins or [(body.boundary, PALE)]:
        if len(facets):
            plotter.add_mesh(surface(body.points, facets), color=colour, ambient=0.75, diffuse=0.3)
    draw_edges(plotter, body.points, creases(body.points, body.boundary), INK, 3)
    for part in shown:
        points = body.points + part.away + 1e-3 * body.size * toward
        plotter.add_mesh(surface(points, part.side.facets), color=part.colour, lighting=False)
        draw_edges(plotter, points, creases(points, part.side.facets), INK, 2)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)
