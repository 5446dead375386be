"""Contact parts of a body in space as they are drawn: where they are, or beside the body if it hides them.

A part that looks away from the eye, as the underside does, is moved along its normal: its footprint.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from ...typing import Array
from . import apart
from .deformed import DeformedBody, PartGeometry
from .style import GREY
from .vtk_view import View


@dataclass(frozen=True)
class Footprint:
    """A contact part as it is drawn.

    Attributes:
        geometry: where it lies on the body.
        points: where the body's vertices would be drawn with it, m, (n, 3).
        away: how far it is moved, m, (3,); zero for one that is drawn where it is.
    """

    geometry: PartGeometry
    points: Array
    away: Array

    @property
    def pressure(self) -> Array:
        """-σ_n by vertex of the body, NaN where it is lifted and off the part."""
        values = np.full(len(self.points), np.nan)
        part = self.geometry.part
        values[self.geometry.vertices] = np.where(part.idle, np.nan, part.pressure)
        return values


def footprints(
    shape: DeformedBody, view: View, parts: Sequence[PartGeometry], normals: Iterable[Array]
) -> list[Footprint]:
    """Each part where it is if it is seen there, else so far out along its normal that nothing covers it.

    Args:
        shape: the deformed body.
        view: from where it is seen.
        parts: where the parts lie on the body.
        normals: outward normals of the parts, of any length, (3,) each.
    """
    size, at = shape.body.size, shape.body.outermost
    body = np.concatenate([shape.points[at], shape.body.points[at]])
    units = (np.asarray(n / (float(np.linalg.norm(n)) or 1.0), dtype=np.float64) for n in normals)
    places = ((shape.points[part.vertices], unit) for part, unit in zip(parts, units, strict=True))
    ways = apart.ways(view, body, places, 0.05 * size)
    nearer = 1e-3 * size * view.toward
    return [
        Footprint(part, shape.points + (way if way.any() else nearer), way)
        for part, way in zip(parts, ways, strict=True)
    ]


def guides(axes: Axes, view: View, shape: DeformedBody, patch: Footprint) -> None:
    """Draw thin lines from a part on the body to its footprint, at its outermost points.

    Args:
        axes: to draw on.
        view: from where the body is seen.
        shape: the deformed body.
        patch: the footprint.
    """
    if not patch.away.any():
        return
    start = view.project(shape.points[patch.geometry.vertices])
    end = view.project(patch.points[patch.geometry.vertices])
    across = np.array([-(end - start)[0, 1], (end - start)[0, 0]])
    for i in (int(np.argmin(start @ across)), int(np.argmax(start @ across))):
        axes.plot(*np.array([start[i], end[i]]).T, color=GREY, lw=1.1, ls=(0, (2, 3)), zorder=0.5)
