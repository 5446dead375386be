"""Which minimisers a saddle joins: the way down from it on both sides, along which the energy only falls.

A saddle with one unstable direction is a pass: on a drop of one law with all other unknowns at a minimum, or with one
negative eigenvalue. From it the descent leads to a minimiser on each side. Between two points of a descent the energy
is below that of the first, because it is below a convex majorant that falls. So two minimisers that a pass joins are
joined by a way whose highest energy is that of the pass. Where all equilibria are known and isolated, the lowest such
way is the least barrier (mountain pass theorem: Ambrosetti and Rabinowitz 1973, Journal of Functional Analysis 14).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .descent import descend
from .point_list import StationaryPoint
from .scalar_problem import ScalarProblem
from .stationarity import Kind, unstable_directions

MOST_DESCENTS = 10
"""Descents that are made one after the other, each of several steps."""
STEPS = tuple(10.0**-k for k in range(2, 10))
"""Lengths of the first step off a saddle, relative to the displacements; the first that lowers the energy is taken."""
NEAR = 1e-4
"""A descent that ends nearer than this share of the displacements to a minimiser has reached it."""


@dataclass(frozen=True, kw_only=True)
class Pass:
    """A saddle with one unstable direction, and where the ways down from it lead.

    Attributes:
        saddle: its number.
        minimisers: numbers of the two at the ends of the descents, ascending.
    """

    saddle: int
    minimisers: tuple[int, int]


def passes(problem: ScalarProblem, points: Sequence[StationaryPoint]) -> tuple[Pass, ...]:
    """The passes between different minimisers, by energy.

    A way over several passes may be lower than the pass that joins its ends.

    Args:
        problem: the problem.
        points: stationary points, by energy.
    """
    found = []
    for number, point in enumerate(points):
        if point.kind is not Kind.SADDLE or (way := _way(problem, point.x)) is None:
            continue
        ends = sorted(_end(problem, points, point, sign * way) for sign in (-1.0, 1.0))
        if -1 < ends[0] < ends[1]:
            found.append(Pass(saddle=number, minimisers=(ends[0], ends[1])))
    return tuple(found)


def _way(problem: ScalarProblem, x: Array) -> Array | None:
    """The unstable direction of a saddle, with largest component 1; None where there are several, or none is known."""
    directions = unstable_directions(problem, x)
    if directions is None or directions.shape[1] != 1:
        return None
    way = directions[:, 0]
    return np.asarray(way / np.max(np.abs(way)))


def _end(problem: ScalarProblem, points: Sequence[StationaryPoint], saddle: StationaryPoint, way: Array) -> int:
    """The number of the minimiser that a descent reaches; -1 where it reaches none."""
    low, high = np.maximum(problem.lower, -problem.far), np.minimum(problem.upper, problem.far)
    size = 1.0 + float(np.max(np.abs(saddle.x), initial=0.0))
    starts = (np.clip(saddle.x + step * size * way, low, high) for step in STEPS)
    start = next((x for x in starts if problem.energy(x) < saddle.energy), None)
    if start is None:
        return -1
    for _ in range(MOST_DESCENTS):
        x, _ = descend(problem, low, high, start)
        if np.array_equal(x, start):
            break
        start = x
    distances = [np.max(np.abs(p.x - start)) if p.kind is Kind.MINIMISER else np.inf for p in points]
    nearest = int(np.argmin(distances))
    return nearest if distances[nearest] < NEAR * size else -1
