"""``scene.png`` of a plane body: undeformed, with the names of its parts, their loads, supports and contact."""

from __future__ import annotations

from matplotlib.artist import Artist
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

from ...reader import Result
from .. import plane_marks as marks
from ..deformed import undeformed
from ..legend import legend
from ..loads_supports import held_sides, loaded_sides, roles_by_side
from ..outline import closed_path
from ..part_names import names
from ..plane_canvas import canvas, window
from ..reach import Reach
from ..regions import TINTS, regions
from ..regions import keys as region_keys
from ..registry import picture
from ..scene_legend import inside, say, touches
from ..style import INK, VERMILION, heading

PALE_BODY = TINTS[0]


@picture(
    "scene",
    dimension=2,
    caption="The scene: the undeformed body with its supports, loads and contact parts.",
    wanted=lambda result: bool(result.sides),
)
def draw(result: Result) -> Figure:
    """Draw the scene of a plane body."""
    body = result.body
    rest = undeformed(body)
    points = rest.points
    drawn = [*marks.supports(rest, held_sides(result)), *marks.loads(rest, loaded_sides(result))]
    fig, axes = canvas([Reach(points[body.outermost, :2]), *(mark.reach for mark in drawn)])
    heading(fig, result, "the scene")
    areas = regions(result)
    for region in areas:
        corners = points[body.cells[region.cells], :2]
        axes.add_collection(PolyCollection(list(corners), fc=region.tint, ec=region.tint, lw=0.3, zorder=0.5))
    outline = closed_path(points, body.outline)
    axes.add_artist(PathPatch(outline, fc="none" if areas else PALE_BODY, ec=INK, lw=1.6, joinstyle="round", zorder=1))
    found = list(roles_by_side(result))
    for side, roles in found:
        if touches(roles):
            axes.plot(*points[side.vertices, :2].T, color=VERMILION, lw=5, solid_capstyle="butt", zorder=2)
    for mark in drawn:
        mark.draw(axes)
    for name in names(rest.as_drawn, [side for side, _ in found], [mark.reach for mark in drawn], window(axes)):
        name.draw(axes)
    say(fig, body, rest.stretched)
    legend(
        fig,
        [*keys(any(touches(roles) for _, roles in found)), *marks.keys(drawn), *region_keys(areas), *inside(result)],
    )
    return fig


def keys(contact: bool) -> list[Artist]:
    """The legend's line for contact parts, if there is one."""
    return [Line2D([], [], color=VERMILION, lw=5, label="contact, friction or adhesion")] if contact else []
