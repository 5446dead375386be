"""``body.png`` of a plane body: deformed over its outline, |u| in it, contact pressure drawn under its parts."""

from __future__ import annotations

from matplotlib.figure import Figure

from ...reader import Result
from ...units import unit_for
from .. import plane_marks as marks
from ..deformed import deform, part_geometries
from ..legend import colour_bar, legend
from ..loads_supports import borne_loads, held_sides
from ..plane_canvas import canvas, paint
from ..reach import Reach
from ..registry import picture
from ..style import SLATE, heading


@picture(
    "body",
    dimension=2,
    caption="The deformed body, its displacements magnified, with what acts on it.",
    wanted=lambda result: result.body.displacement is not None,
)
def draw(result: Result) -> Figure:
    """Draw the body with its loads, supports and contact parts."""
    body, parts = result.body, part_geometries(result)
    shape = deform(body, parts)
    drawn = [
        *marks.supports(shape, held_sides(result)),
        *marks.loads(shape, borne_loads(result)),
        *marks.contacts(shape, parts),
    ]
    fig, axes = canvas(
        [Reach(shape.points[body.outermost, :2]), Reach(shape.at_rest[body.outermost, :2]), *(m.reach for m in drawn)]
    )
    heading(fig, result, "deformed body")
    largest = float(shape.amount.max())
    paint(axes, shape, shape.amount[body.cells], SLATE, largest)
    for mark in drawn:
        mark.draw(axes)
    unit = unit_for(largest, "m")
    words = f"displacement |u|, up to {unit.text(largest)}"
    colour_bar(fig, SLATE, (0.0, largest / unit.size), words, shape.scales)
    legend(fig, [marks.undeformed(), *marks.keys(drawn)])
    return fig
