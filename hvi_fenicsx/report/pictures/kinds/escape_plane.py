"""``escape.png``: where a body goes that nothing holds. Its ghost, moved along the motion, and the motion in words."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from ....typing import Array
from ...body_mesh import BodyMesh
from ...reader import Result
from .. import plane_marks as marks
from ..deformed import undeformed
from ..escape_marks import WAY, arrow, keys, say
from ..finite_motion import fitted, followed
from ..loads_supports import held_sides, loaded_sides
from ..outline import closed_path
from ..plane_canvas import canvas
from ..reach import Reach
from ..registry import picture
from ..style import INK, PALE, VERMILION, heading


@picture(
    "escape",
    dimension=2,
    caption="The rigid motion along which the load carries the body away.",
    wanted=lambda result: result.body.escape_mode is not None,
)
def draw(result: Result) -> Figure:
    """Draw a plane body and its ghost."""
    rest = undeformed(result.body)
    body, mover = rest.as_drawn, rest.as_drawn.moving()
    motion = fitted(mover)
    drawn = [*marks.supports(rest, held_sides(result)), *marks.loads(rest, loaded_sides(result))]
    ghost, posts = motion.at(mover.points), followed(mover, motion)
    ways = np.stack([motion.at(posts, part)[:, :2] for part in WAY], axis=1)
    moved = np.concatenate([body.points[:, :2], ghost[:, :2], ways.reshape(-1, 2)])
    fig, axes = canvas([Reach(moved), *(mark.reach for mark in drawn)])
    heading(fig, result, "rigid motion")
    _bodies(axes, body, mover, ghost)
    for mark in drawn:
        mark.draw(axes)
    for way in ways:
        arrow(axes, way)
    say(fig, result, [*keys(rest.stretched), *marks.keys(drawn)])
    return fig


def _bodies(axes: Axes, body: BodyMesh, mover: BodyMesh, ghost: Array) -> None:
    axes.add_artist(PathPatch(closed_path(body.points, body.outline), fc=PALE, ec=INK, lw=1.6, zorder=1))
    loops = mover.outline
    axes.add_artist(PathPatch(closed_path(ghost, loops), fc="none", ec=VERMILION, lw=2, ls=(0, (5, 3)), zorder=4))
    axes.add_artist(PathPatch(closed_path(ghost, loops), fc=VERMILION, alpha=0.12, lw=0, zorder=3))
