"""The names of the parts of a plane body, each beside its part where it covers least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely

from ...typing import Array
from ..body_mesh import BodyMesh
from .loads_supports import Side
from .reach import APART, WAYS, Label, Reach, boxes
from .style import BLUE

PLACES = (0.5, 0.4, 0.6, 0.25, 0.75, 0.1, 0.9)
"""Parts of a side's length at which its name may stand."""
AWAY = (APART, 0.22, 0.4, 0.6)
"""How far from there, inches; a name that is not beside its side has a line to it."""
EDGE = 0.05
"""Inches from an outline that a name leaves free: half of the line that marks contact, and a little."""
SPOILS, TOUCHES, CROSSES, LEAVES, TURNS, FAR, AFAR = 10.0, 2.5, 0.5, 20.0, 0.4, 0.5, 0.6
"""What it counts to cover what is drawn, to touch an outline or cross it with the line to a name, to leave the picture,
to stand outside of the body, to be the side's length off its middle, and to be an inch away from it."""
LIES, STANDS = 0.05, 0.3
"""What it counts to lie beside an upright side, and to be upright away from it."""


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
    lines = shapely.union_all([shapely.linestrings(body.points[loop, :2]) for loop in body.outline])
    wide = lines.simplify(0.1 * EDGE / scale).buffer(EDGE / scale)
    for geometry in (lines, wide):
        shapely.prepare(geometry)
    taken, found = [reach.hull(scale) for reach in drawn if len(reach.points)], list[Label]()
    for side in sides:
        candidates = list(_candidates(body, side))
        labels = [label for label, _ in candidates]
        places = boxes(labels, scale)
        spoilt = shapely.area(shapely.intersection(places, shapely.union_all(taken)))
        left = shapely.area(shapely.difference(places, inside))
        cost = (SPOILS * spoilt + LEAVES * left) / shapely.area(places) + TOUCHES * shapely.intersects(places, wide)
        cost += CROSSES * shapely.intersects(_leaders(labels, scale), lines)
        best = int(np.argmin(np.round(cost + [own for _, own in candidates], 6)))
        found.append(labels[best])
        taken.append(places[best])
    return found


def _leaders(labels: Sequence[Label], scale: float) -> Array:
    """The lines from a side to its names, without their beginning on the side: shapely's lines, (k,)."""
    ends = [[label.at + inches / scale * label.way for inches in (EDGE, label.away)] for label in labels]
    return np.asarray(shapely.linestrings(np.array(ends)))


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
                for away in AWAY:
                    label = Label(side.part, at, way, weight="normal", colour=BLUE, upright=upright, away=away)
                    turned = LIES * (not upright) if away == APART else STANDS * upright
                    found.append((label, cost + turned + AFAR * (away - APART)))
    return found
