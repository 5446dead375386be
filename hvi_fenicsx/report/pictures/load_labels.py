"""Values of loads on a body in space, each beside arrows of its own, where it covers least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ...typing import Array
from .loads_supports import LoadedSide
from .plane_canvas import SIDE, TALLEST
from .reach import LINE, WAYS, Label, Reach, boxes, largest_scale
from .vtk_view import View

HEAD = 0.09
"""Inches: half of the head of an arrow."""
SPOILS, FAR = 10.0, 0.3
"""What it counts to cover an arrow or other words, or to be a body's size off the middle; to cover the body is 1."""


def reaches(view: View, points: Array, arrows: Sequence[tuple[Array, Array]]) -> list[Reach]:
    """What a picture of a body and its arrows reaches, without the values of the loads.

    Args:
        view: from where the body is seen.
        points: of the body and of its parts where they are drawn, m, (n, 3).
        arrows: of each load, as :func:`.vtk_loads.arrows` gives them.
    """
    ends = [view.project(np.concatenate([tails, tails + ways])) for tails, ways in arrows]
    half = np.full(2, HEAD)
    return [Reach(view.project(points)), *(Reach(own, half, half) for own in ends)]


def labels(
    view: View,
    clouds: Sequence[Array],
    pulled: Sequence[LoadedSide],
    arrows: Sequence[tuple[Array, Array]],
    words: Sequence[Reach] = (),
) -> list[Label]:
    """The largest value of each load.

    Args:
        view: from where the body is seen.
        clouds: points of the body and of each part that is drawn beside it, m, (n, 3).
        pulled: the loads.
        arrows: of each load.
        words: what is written already.
    """
    reached = [*reaches(view, np.concatenate(clouds), arrows), *words]
    scale = largest_scale(reached, (SIDE, TALLEST))
    hulls = shapely.convex_hull([shapely.multipoints(view.project(c)) for c in clouds])
    bodies = shapely.union_all(shapely.buffer(hulls, LINE / scale))
    taken = [*(one.hull(scale) for one in words), *strokes(view, arrows, scale)]
    found = list[Label]()
    for load, (tails, ways) in zip(pulled, arrows, strict=True):
        ends = view.project(np.concatenate([tails, tails + ways]))
        found.append(_best([Label(load.value, end, way) for end in ends for way in WAYS], ends, taken, bodies, scale))
        taken.append(found[-1].reach.hull(scale))
    return found


def strokes(view: View, arrows: Sequence[tuple[Array, Array]], scale: float) -> list[shapely.Geometry]:
    """What the arrows cover of a picture, m.

    Args:
        view: from where the body is seen.
        arrows: of each load.
        scale: of the picture, inches for a metre.
    """
    lines = [np.stack([view.project(tails), view.project(tails + ways)], axis=1) for tails, ways in arrows]
    return [stroke for own in lines for stroke in shapely.buffer(shapely.linestrings(own), HEAD / scale)]


def _best(
    candidates: list[Label], ends: Array, taken: list[shapely.Geometry], bodies: shapely.Geometry, scale: float
) -> Label:
    places = boxes(candidates, scale)
    spoilt = shapely.area(shapely.intersection(places, shapely.union_all(taken)))
    covered = shapely.area(shapely.intersection(places, bodies))
    middle = shapely.Point(ends.mean(axis=0))
    size = float(np.hypot(*np.ptp(shapely.get_coordinates(bodies), axis=0)))
    cost = (SPOILS * spoilt + covered) / shapely.area(places) + FAR * shapely.distance(places, middle) / size
    return candidates[int(np.argmin(np.round(cost, 6)))]
