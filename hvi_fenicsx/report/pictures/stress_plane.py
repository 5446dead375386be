"""``stress.png`` of a plane body: the von Mises stress by cell, with loads, supports and obstacles around it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..reader import Result
from ..units import times, unit_for
from ..vtu import Body
from . import plane_marks as marks
from .body_plane import canvas, paint
from .deformed import Scale, deform, footings, largest_stress, scale_of
from .legend import colour_bar, legend
from .loads_supports import loads, supports
from .style import EMBER, heading, save

FIELD = "von_mises"


def draw(path: Path, result: Result, body: Body) -> None:
    """Draw the deformed body, each cell in the colour of its stress."""
    parts = footings(result, body)
    shape, values = deform(body, parts), body.by_cell[FIELD]
    drawn = [
        *marks.supports(shape, supports(result, body)),
        *marks.loads(shape, loads(result, body)),
        *(m for part in parts for m in marks.footing(shape, part, largest_stress(parts))),
    ]
    made, axes = canvas(np.concatenate([shape.points[:, :2], body.points[:, :2], *(m.extent for m in drawn)]))
    heading(made, result, "stress in the body")
    scale = scale_of(body, values)
    apart = np.arange(body.cells.size).reshape(body.cells.shape)  # corners that no two cells share
    paint(axes, shape, apart, shape.points[body.cells.ravel()], np.repeat(values, 3), EMBER, scale.end)
    for mark in drawn:
        mark.draw(axes)
    bar(made, scale, times(shape.factor))
    legend(made, [marks.undeformed(), *marks.keys(drawn)])
    save(made, path)


def bar(made: Figure, scale: Scale, remark: str) -> None:
    """The bar of the stress, and how large it is where the scale does not reach."""
    unit = unit_for(scale.end, "Pa")
    words = f"von Mises stress, {'peak' if scale.cut else 'up to'} {unit.text(scale.largest)}"
    colour_bar(made, EMBER, (0.0, scale.end / unit.size), words, remark)
