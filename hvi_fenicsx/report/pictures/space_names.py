"""The names of the parts of a body in space, each where it covers least: on its part, or beside one it would hide."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ...typing import Array
from .load_labels import reaches, strokes
from .plane_canvas import SIDE, TALLEST
from .reach import WAYS, Label, largest_scale
from .style import BLUE
from .vtk_view import View

PLACES = 15
"""On a part, along each side of the rectangle around it."""
AWAY = (0.3, 0.5, 0.8)
"""How far from the middle of a part a name beside it stands, inches."""
SPOILS, LEAVES, HIDES, FAR, BESIDE = 10.0, 4.0, 2.0, 1.0, 1.0
"""What it counts to cover an arrow, another part or another name, to leave the part, to hide it, to be the part's size
off its middle, and to stand beside it."""


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
    hulls = [shapely.MultiPoint(view.project(points)).convex_hull for _, points in parts]
    for place, (name, points) in enumerate(parts):
        others = [*hulls[:place], *hulls[place + 1 :]]
        on = _on(name, view.project(points), hulls[place], taken, scale)
        found.append(min(on, _beside(name, hulls[place], [*taken, *others], scale), key=lambda best: best[0])[1])
        taken.append(found[-1].reach.hull(scale))
    return found


Priced = tuple[float, Label]
"""A label and what it costs."""


def _on(name: str, points: Array, hull: shapely.Geometry, taken: Sequence[shapely.Geometry], scale: float) -> Priced:
    """The best label on a part."""
    middle = points.mean(axis=0)
    sides = np.linspace(points.min(axis=0), points.max(axis=0), PLACES)
    places = [middle, *(np.array([x, y]) for x in sides[:, 0] for y in sides[:, 1])]
    labels = [Label(name, at, np.zeros(2), weight="normal", colour=BLUE) for at in places]
    boxes = np.array([label.reach.hull(scale) for label in labels])
    area, left = shapely.area(boxes), shapely.area(shapely.difference(boxes, hull))
    away = np.linalg.norm(np.array(places) - middle, axis=1) / (float(np.hypot(*np.ptp(points, axis=0))) or 1.0)
    hidden = (area - left) / (hull.area or 1.0)
    return _cheapest(labels, LEAVES * left / area + HIDES * hidden + FAR * away + _spoilt(boxes, taken))


def _beside(name: str, hull: shapely.Geometry, taken: Sequence[shapely.Geometry], scale: float) -> Priced:
    """The best label beside a part, with a line to its middle."""
    middle = np.array(hull.centroid.coords[0])
    labels = [Label(name, middle, way, weight="normal", colour=BLUE, away=away) for away in AWAY for way in WAYS]
    boxes = np.array([label.reach.hull(scale) for label in labels])
    away = np.array([label.away for label in labels])
    return _cheapest(labels, BESIDE + away + _spoilt(boxes, [*taken, hull]))


def _spoilt(boxes: Array, taken: Sequence[shapely.Geometry]) -> Array:
    covered = shapely.area(shapely.intersection(boxes, shapely.union_all(taken)))
    return np.asarray(SPOILS * covered / shapely.area(boxes))


def _cheapest(labels: Sequence[Label], cost: Array) -> Priced:
    best = int(np.argmin(np.round(cost, 6)))
    return float(cost[best]), labels[best]
