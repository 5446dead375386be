"""``escape.png`` of a body in space: the body, its ghost moved along the motion, and the motion in words."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from ....typing import Array
from ...body_mesh import BodyMesh
from ...reader import Result
from .. import vtk_loads
from ..creases import creases
from ..deformed import DeformedBody
from ..escape_marks import WAY, arrow, keys, say
from ..finite_motion import fitted, followed
from ..load_labels import labels, reaches
from ..loads_supports import loaded_sides
from ..registry import picture
from ..space_canvas import space_canvas
from ..style import INK, PALE, VERMILION, heading
from ..vtk_view import best_view, draw_edges, render, surface

if TYPE_CHECKING:
    import pyvista


@picture(
    "escape",
    dimension=3,
    rendered=True,
    caption="The rigid motion along which the load carries the body away.",
    wanted=lambda result: result.body.escape_mode is not None,
)
def draw(result: Result) -> Figure:
    """Draw a body in space and its ghost."""
    body, mover, view = result.body, result.body.moving(), best_view([])
    motion = fitted(mover)
    rest, pulled = DeformedBody(body, np.zeros_like(body.points), 1.0), loaded_sides(result)
    arrows = [vtk_loads.arrows(rest, load) for load in pulled]
    ghost, posts = motion.at(mover.points), followed(mover, motion)
    posts = posts[view.depth(posts) >= np.quantile(view.depth(posts), 0.15)]  # not the one behind the body
    ways = np.stack([motion.at(posts, part) for part in WAY], axis=1)
    reached = [body.points, ghost, ways.reshape(-1, 3)]
    everything = np.concatenate([*reached, *(end for tails, along in arrows for end in (tails, tails + along))])
    found = labels(view, reached, pulled, arrows)
    fig, axes = space_canvas(view, [*reaches(view, np.concatenate(reached), arrows), *(label.reach for label in found)])
    heading(fig, result, "rigid motion")
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    nearer = ghost + 1e-3 * body.size * view.toward  # where the two share a face, the ghost's is seen
    render(axes, view, depths, partial(_fill, body=body, mover=mover, ghost=nearer, arrows=arrows))
    for label in found:
        label.draw(axes)
    for way in ways:
        arrow(axes, view.project(way))
    say(fig, result, keys())
    return fig


def _fill(
    plotter: pyvista.Plotter, *, body: BodyMesh, mover: BodyMesh, ghost: Array, arrows: list[tuple[Array, Array]]
) -> None:
    facets = body.boundary
    plotter.add_mesh(surface(body.points, facets), color=PALE, ambient=0.75, diffuse=0.3)
    draw_edges(plotter, body.points, creases(body.points, facets), INK, 3)
    facets = mover.boundary
    plotter.add_mesh(surface(ghost, facets), color=VERMILION, opacity=0.16, lighting=False)
    draw_edges(plotter, ghost, creases(mover.points, facets), VERMILION, 4)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)
