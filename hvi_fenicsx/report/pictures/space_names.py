"""The names of the parts of a body in space, each on its part where it covers least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ...typing import Array
from .load_labels import reaches, strokes
from .plane_canvas import SIDE, TALLEST
from .reach import Label, largest_scale
from .style import BLUE
from .vtk_view import View

PLACES = 15
"""On a part, along each side of the rectangle around it."""
SPOILS, LEAVES, FAR = 10.0, 4.0, 1.0
"""What it counts to cover an arrow or another name, to leave the part, and to be the part's size off its middle."""


def names(
    view: View, body: Array, parts: Sequence[tuple[str, Array]], arrows: Sequence[tuple[Array, Array]]
) -> list[Label]:
    """A label for each part.

    Args:
        view: from where the body is seen.
        body: points of the body, m, (n, 3).
        parts: the name of each part and its points where they are drawn, m, (m, 3).
        arrows: of each load, as :func:`.vtk_loads.arrows` gives them.
    """
    everything = np.concatenate([body, *(points for _, points in parts)])
    scale = largest_scale(reaches(view, everything, arrows), (SIDE, TALLEST))
    taken, found = strokes(view, arrows, scale), list[Label]()
    for name, points in parts:
        found.append(_best(name, view.project(points), taken, scale))
        taken.append(found[-1].reach.hull(scale))
    return found


def _best(name: str, points: Array, taken: Sequence[shapely.Geometry], scale: float) -> Label:
    middle, hull = points.mean(axis=0), shapely.MultiPoint(points).convex_hull
    sides = np.linspace(points.min(axis=0), points.max(axis=0), PLACES)
    places = [middle, *(np.array([x, y]) for x in sides[:, 0] for y in sides[:, 1])]
    labels = [Label(name, at, np.zeros(2), weight="normal", colour=BLUE) for at in places]
    boxes = np.array([label.reach.hull(scale) for label in labels])
    spoilt = shapely.area(shapely.intersection(boxes, shapely.union_all(taken)))
    left = shapely.area(shapely.difference(boxes, hull))
    away = np.linalg.norm(np.array(places) - middle, axis=1) / (float(np.hypot(*np.ptp(points, axis=0))) or 1.0)
    cost = (SPOILS * spoilt + LEAVES * left) / shapely.area(boxes) + FAR * away
    return labels[int(np.argmin(np.round(cost, 6)))]
