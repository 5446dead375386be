"""The names of the parts of a body in space, each where it covers least: on its part, or beside one it would hide."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ...typing import Array
from .load_labels import reaches, strokes
from .plane_canvas import SIDE, TALLEST
from .reach import WAYS, Label, boxes, largest_scale
from .seen import Seen, Surface, seen
from .style import BLUE
from .vtk_view import View

PLACES = 25
"""On a part, along each side of the rectangle around it."""
AWAY = (0.3, 0.5, 0.8)
"""How far from the middle of a part a name beside it stands, inches."""
SPOILS, LEAVES, HIDES, FAR, BESIDE = 10.0, 4.0, 2.0, 1.0, 1.0
"""What it counts to cover an arrow, another part or another name, to leave the part, to hide it, to be the part's size
off its middle, and to stand beside it."""


def names(
    view: View, body: Surface, parts: Sequence[tuple[str, Surface]], arrows: Sequence[tuple[Array, Array]]
) -> list[Label]:
    """A label for each part.

    Args:
        view: from where the body is seen.
        body: its boundary.
        parts: the name of each part, and the part where it is drawn.
        arrows: of each load, as :func:`.vtk_loads.arrows` gives them.
    """
    surfaces = [body, *(part for _, part in parts)]
    everything = np.concatenate([surface.used for surface in surfaces])
    scale = largest_scale(reaches(view, everything, arrows), (SIDE, TALLEST))
    taken, found = strokes(view, arrows, scale), list[Label]()
    _, *pieces = seen(view, surfaces)
    for (name, _), piece in zip(parts, pieces, strict=True):
        others = [other for other in pieces if other is not piece]
        on, beside = _on(name, piece, taken, scale), _beside(name, piece, others, taken, scale)
        found.append(min(on, beside, key=lambda best: best[0])[1])
        taken.append(found[-1].reach.hull(scale))
    return found


Priced = tuple[float, Label]
"""A label and what it costs."""


def _on(name: str, piece: Seen, taken: Sequence[shapely.Geometry], scale: float) -> Priced:
    """The best label on a part."""
    sides = np.linspace(piece.middles.min(axis=0), piece.middles.max(axis=0), PLACES)
    places = [piece.middle, *(np.array([x, y]) for x in sides[:, 0] for y in sides[:, 1])]
    labels = [Label(name, at, np.zeros(2), weight="normal", colour=BLUE) for at in places]
    taking = boxes(labels, scale)
    on, extent = piece.within(shapely.bounds(taking)), float(np.hypot(*np.ptp(piece.middles, axis=0)))
    away = np.linalg.norm(np.array(places) - piece.middle, axis=1) / (extent or 1.0)
    left = np.maximum(1.0 - on / shapely.area(taking), 0.0)
    return _cheapest(labels, LEAVES * left + HIDES * on / piece.area + FAR * away + _spoilt(taking, taken))


def _beside(name: str, piece: Seen, others: Sequence[Seen], taken: Sequence[shapely.Geometry], scale: float) -> Priced:
    """The best label beside a part, with a line to its middle."""
    labels = [Label(name, piece.middle, way, weight="normal", colour=BLUE, away=away) for away in AWAY for way in WAYS]
    taking = boxes(labels, scale)
    away = np.array([label.away for label in labels])
    on = sum(one.within(shapely.bounds(taking)) for one in (piece, *others)) / shapely.area(taking)
    return _cheapest(labels, BESIDE + away + SPOILS * on + _spoilt(taking, taken))


def _spoilt(letters: Array, taken: Sequence[shapely.Geometry]) -> Array:
    covered = shapely.area(shapely.intersection(letters, shapely.union_all(taken)))
    return np.asarray(SPOILS * covered / shapely.area(letters))


def _cheapest(labels: Sequence[Label], cost: Array) -> Priced:
    best = int(np.argmin(np.round(cost, 6)))
    return float(cost[best]), labels[best]
