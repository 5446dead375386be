"""``scene.png`` of a plane body: undeformed, with the names of its parts, their loads, supports and contact."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

from ....geometry import chains
from ...body_mesh import BodyMesh
from ...reader import Result
from .. import plane_marks as marks
from ..deformed import DeformedBody
from ..legend import legend
from ..loads_supports import Side, held_sides, loaded_sides, roles_by_side
from ..outline import closed_path
from ..plane_canvas import canvas
from ..reach import Reach
from ..regions import TINTS, regions
from ..regions import keys as region_keys
from ..registry import picture
from ..scene_legend import inside, say, touches
from ..style import BLUE, INK, VERMILION, heading

PALE_BODY = TINTS[0]
INSIDE = 0.045
"""How far inside of its part a name is written, of the body's size."""


@picture(
    "scene",
    dimension=2,
    caption="The scene: the undeformed body with its supports, loads and contact parts.",
    wanted=lambda result: bool(result.sides),
)
def draw(result: Result) -> Figure:
    """Draw the scene of a plane body."""
    body = result.body
    rest = DeformedBody(body, np.zeros_like(body.points), 1.0)
    drawn = [*marks.supports(rest, held_sides(result)), *marks.loads(rest, loaded_sides(result))]
    fig, axes = canvas([Reach(body.points[:, :2]), *(mark.reach for mark in drawn)])
    heading(fig, result, "the scene")
    areas = regions(result)
    for region in areas:
        corners = body.points[body.cells[region.cells], :2]
        axes.add_collection(PolyCollection(list(corners), fc=region.tint, ec=region.tint, lw=0.3, zorder=0.5))
    outline = closed_path(body.points, chains(body.boundary))
    axes.add_patch(PathPatch(outline, fc="none" if areas else PALE_BODY, ec=INK, lw=1.6, joinstyle="round", zorder=1))
    found = list(roles_by_side(result))
    for side, roles in found:
        _part(axes, body, side, contact=touches(roles))
    for mark in drawn:
        mark.draw(axes)
    say(fig, body)
    legend(
        fig,
        [*keys(any(touches(roles) for _, roles in found)), *marks.keys(drawn), *region_keys(areas), *inside(result)],
    )
    return fig


def keys(contact: bool) -> list[Artist]:
    """The legend's line for contact parts, if there is one."""
    return [Line2D([], [], color=VERMILION, lw=5, label="contact, friction or adhesion")] if contact else []


def _part(axes: Axes, body: BodyMesh, side: Side, *, contact: bool) -> None:
    """The part's line where something touches it, and its name inside of it."""
    line = body.points[side.vertices, :2]
    if contact:
        axes.plot(*line.T, color=VERMILION, lw=5, solid_capstyle="butt", zorder=2)
    middle, inward = len(line) // 2, -side.normals[len(line) // 2, :2]
    depth = min(INSIDE * body.size, float(np.ptp(body.points[:, :2], axis=0).min()) / 2)
    at = (line[(len(line) - 1) // 2] + line[middle]) / 2 + depth * inward
    upright = abs(inward[0]) > 0.8
    halo = {"boxstyle": "round,pad=0.1", "fc": PALE_BODY, "ec": "none", "alpha": 0.8}
    style: dict[str, Any] = {"ha": "center", "va": "center", "size": 12.5, "color": BLUE, "bbox": halo, "zorder": 8}
    axes.text(at[0], at[1], side.part, rotation=90 if upright else 0, **style)
