"""The names of the parts of a plane body, each beside its part where it covers least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ...geometry import chains
from ...typing import Array
from ..body_mesh import BodyMesh
from .loads_supports import Side
from .reach import WAYS, Label, Reach
from .style import BLUE

PLACES = (0.5, 0.4, 0.6, 0.25, 0.75, 0.1, 0.9)
"""Parts of a side's length at which its name may stand."""
SPOILS, CROSSES, LEAVES, TURNS, FAR = 10.0, 4.0, 20.0, 0.4, 0.5
"""What it counts to cover what is drawn, to cross an outline by half of its own border, to leave the picture, to stand
outside of the body, and to be the side's length off its middle."""


def names(body: BodyMesh, sides: Sequence[Side], drawn: Sequence[Reach], window: Array) -> list[Label]:
    """A label for each side.

    Args:
        body: the body.
        sides: its sides.
        drawn: the marks around it.
        window: what the picture shows, its lower left and its upper right corner, m, and their distance apart in
            inches, (3, 2).
    """
    low, high, inches = window
    scale, inside = float(inches[0] / (high[0] - low[0])), shapely.box(*low, *high)
    lines = shapely.union_all([shapely.LineString(body.points[loop, :2]) for loop in chains(body.boundary)])
    taken, found = [reach.hull(scale) for reach in drawn if len(reach.points)], list[Label]()
    for side in sides:
        candidates = list(_candidates(body, side))
        labels = [label for label, _ in candidates]
        boxes = np.array([label.reach.hull(scale) for label in labels])
        spoilt = shapely.area(shapely.intersection(boxes, shapely.union_all(taken)))
        crossed = shapely.length(shapely.intersection(boxes, lines)) / shapely.length(boxes)
        left = shapely.area(shapely.difference(boxes, inside))
        cost = (SPOILS * spoilt + LEAVES * left) / shapely.area(boxes) + CROSSES * crossed
        best = int(np.argmin(np.round(cost + [own for _, own in candidates], 6)))
        found.append(labels[best])
        taken.append(boxes[best])
    return found


def _candidates(body: BodyMesh, side: Side) -> list[tuple[Label, float]]:
    """Labels of a side, and what each costs by where it stands."""
    line = body.points[side.vertices, :2]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    found = []
    for part in PLACES:
        at = np.array([np.interp(part * s[-1], s, column) for column in line.T])
        inward = -np.array([np.interp(part * s[-1], s, column) for column in side.normals[:, :2].T])
        for way in WAYS:
            cost = FAR * abs(part - 0.5) + TURNS * (1.0 - float(way @ inward)) / 2
            for upright in {False, bool(abs(inward[0]) > 0.8)}:
                label = Label(side.part, at, way, weight="normal", colour=BLUE, upright=upright)
                found.append((label, cost + 0.05 * (not upright)))
    return found
