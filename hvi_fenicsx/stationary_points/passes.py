"""Which minimisers a saddle joins: the way down from it on both sides, along which the energy only falls.

A saddle with one unstable direction is a pass: on a drop of one law with all other unknowns at a minimum, or with one
negative eigenvalue. From it the descent leads to a minimiser on each side. Between two points of a descent the energy
is below that of the first, because it is below a convex majorant that falls; a descent ends where the energy is convex
between it and a minimiser. So two minimisers that a pass joins are
joined by a way whose highest energy is that of the pass. Where all equilibria are known and isolated, the lowest such
way is the least barrier (mountain pass theorem: Ambrosetti and Rabinowitz 1973, Journal of Functional Analysis 14).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .landscapes import Landscape
from .point_list import StationaryPoint
from .stationarity import Kind


@dataclass(frozen=True, kw_only=True)
class Pass:
    """A saddle with one unstable direction, and where the ways down from it lead.

    Attributes:
        saddle: its number.
        minimisers: numbers of the two at the ends of the descents, ascending.
    """

    saddle: int
    minimisers: tuple[int, int]


def passes(landscape: Landscape, points: Sequence[StationaryPoint]) -> tuple[Pass, ...]:
    """The passes between different minimisers, by energy.

    A way over several passes may be lower than the pass that joins its ends.

    Args:
        landscape: the energy.
        points: stationary points, by energy.
    """
    found = []
    for number, point in enumerate(points):
        if point.kind is not Kind.SADDLE or (way := _way(landscape, point.x)) is None:
            continue
        ends = sorted(_end(landscape, points, point, sign * way) for sign in (-1.0, 1.0))
        if -1 < ends[0] < ends[1]:
            found.append(Pass(saddle=number, minimisers=(ends[0], ends[1])))
    return tuple(found)


def _way(landscape: Landscape, x: Array) -> Array | None:
    """The unstable direction of a saddle, with largest component 1; None where there are several, or none is known."""
    directions = landscape.unstable_directions(x)
    if directions is None or directions.shape[1] != 1:
        return None
    way = directions[:, 0]
    return np.asarray(way / np.max(np.abs(way)))


def _end(landscape: Landscape, points: Sequence[StationaryPoint], saddle: StationaryPoint, way: Array) -> int:
    """The number of the minimiser that a descent reaches; -1 where it reaches none."""
    size = 1.0 + float(np.max(np.abs(saddle.x), initial=0.0))
    x = _start(landscape, saddle, size * way)
    minimisers = [i for i, p in enumerate(points) if p.kind is Kind.MINIMISER]
    if x is None or not minimisers:
        return -1
    places, before = np.array([points[i].x for i in minimisers]), None
    for _ in range(landscape.thresholds.most_descents):
        distances = np.max(np.abs(places - x), axis=1)
        k = int(np.argmin(distances))
        if landscape.is_convex(np.minimum(x, places[k]), np.maximum(x, places[k])):
            return minimisers[k]
        if before is not None and np.array_equal(x, before):
            break
        before, x = x, landscape.lower(x)
    return minimisers[k] if distances[k] < landscape.thresholds.near * size else -1


def _start(landscape: Landscape, saddle: StationaryPoint, way: Array) -> Array | None:
    """A place beside a saddle to which the energy falls; None if none is found."""
    for step in landscape.thresholds.first_steps:
        places = [np.clip(saddle.x + share * step * way, *landscape.ends) for share in landscape.thresholds.shares]
        if all(landscape.energy(x) < saddle.energy for x in places):
            return places[-1]
    return None
