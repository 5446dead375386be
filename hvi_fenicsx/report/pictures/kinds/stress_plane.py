"""``stress.png`` of a plane body: the von Mises stress by cell, with loads, supports and obstacles around it."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...reader import Result
from .. import plane_marks as marks
from ..deformed import deform, part_geometries
from ..legend import legend
from ..loads_supports import borne_loads, held_sides
from ..plane_canvas import canvas, paint
from ..reach import Reach
from ..registry import picture
from ..stress_scale import bar, scale_of
from ..style import EMBER, heading


@picture(
    "stress",
    dimension=2,
    caption="Stress in the body (von Mises), constant in each cell; the scale may end below a peak in a corner.",
    wanted=lambda result: result.body.von_mises is not None,
)
def draw(result: Result) -> Figure:
    """Draw the deformed body, each cell in the colour of its stress."""
    body, parts = result.body, part_geometries(result)
    assert body.von_mises is not None
    shape, values = deform(body, parts), body.von_mises
    drawn = [
        *marks.supports(shape, held_sides(result)),
        *marks.loads(shape, borne_loads(result)),
        *marks.contacts(shape, parts),
    ]
    fig, axes = canvas(
        [Reach(shape.points[body.outermost, :2]), Reach(shape.at_rest[body.outermost, :2]), *(m.reach for m in drawn)]
    )
    heading(fig, result, "stress in the body")
    scale = scale_of(body, values)
    paint(axes, shape, np.broadcast_to(values[:, None], body.cells.shape), EMBER, scale.end)
    for mark in drawn:
        mark.draw(axes)
    bar(fig, scale, shape.scales)
    legend(fig, [marks.undeformed(), *marks.keys(drawn)])
    return fig
