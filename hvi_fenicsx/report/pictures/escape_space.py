"""``escape.png`` of a body in space: the body, its ghost moved along the motion, and the motion in words."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...typing import Array
from ..reader import Result
from ..vtu import Body
from . import vtk_loads
from .body_plane import canvas
from .deformed import Deformed
from .escape_plane import WAY, arrow, keys, say
from .finite_motion import fitted, followed
from .loads_supports import loads
from .style import INK, PALE, VERMILION, heading, save
from .vtk_view import best_view, creases, render, surface

if TYPE_CHECKING:
    import pyvista


def draw(path: Path, result: Result, body: Body) -> None:
    """Draw a body in space and its ghost."""
    mover, view = body.moving("escape_mode"), best_view([])
    motion = fitted(mover, mover.fields["escape_mode"])
    rest, pulled = Deformed(body, np.zeros_like(body.points), 1.0), loads(result, body)
    arrows = [vtk_loads.arrows(rest, load) for load in pulled]
    ghost, posts = motion.at(mover.points), followed(mover, motion)
    posts = posts[view.depth(posts) >= np.quantile(view.depth(posts), 0.15)]  # not the one behind the body
    ways = np.stack([motion.at(posts, part) for part in WAY], axis=1)
    reached = [end for tails, along in arrows for end in (tails, tails + along)]
    everything = np.concatenate([body.points, ghost, ways.reshape(-1, 3), *reached])
    made, axes = canvas(view.project(everything))
    heading(made, result, "rigid motion")
    depths = (float(view.depth(everything).min()), float(view.depth(everything).max()))
    nearer = ghost + 1e-3 * body.size * view.toward  # where the two share a face, the ghost's is seen
    render(axes, view, depths, partial(_fill, body=body, mover=mover, ghost=nearer, arrows=arrows))
    vtk_loads.labels(axes, view, rest, pulled)
    for way in ways:
        arrow(axes, view.project(way))
    say(made, result, keys())
    save(made, path)


def _fill(
    plotter: pyvista.Plotter, *, body: Body, mover: Body, ghost: Array, arrows: list[tuple[Array, Array]]
) -> None:
    facets = body.boundary
    plotter.add_mesh(surface(body.points, facets), color=PALE, ambient=0.75, diffuse=0.3)
    plotter.add_mesh(creases(body.points, facets), color=INK, line_width=3)
    facets = mover.boundary
    plotter.add_mesh(surface(ghost, facets), color=VERMILION, opacity=0.16, lighting=False)
    plotter.add_mesh(creases(ghost, facets), color=VERMILION, line_width=4)
    for tails, ways in arrows:
        vtk_loads.fill(plotter, tails, ways)
