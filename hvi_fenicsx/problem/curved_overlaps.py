"""Where the curved facets of two sides in the plane lie over each other.

A point of the second side belongs to the point of the first that it is projected onto along the normal of the first
facet's chord, as of straight facets (:mod:`.facet_overlaps`). Places along this chord are quadratic in the reference
coordinates of both facets, so pairs of points are found in closed form.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import basix
import numpy as np
from typing_extensions import override

from ..typing import Array, Integers
from . import curved_shapes, facet_overlaps
from .facet_overlaps import Facets, OverlapPoints, Overlaps
from .thresholds import DEFAULT, CompositionThresholds

_DEGREE = 12
"""Degree of the quadrature: lengths are square roots of polynomials, nearly constant ones."""


@dataclass(frozen=True, kw_only=True)
class CurvedOverlaps(Overlaps):
    """The intersections of curved facets (k of them).

    Attributes:
        nodes: of the first side's facet, both ends and the middle, m, (k, 3, 2).
        own: the places of these along their chord, from 0 to 1, (k, 3).
        other: those of the nodes of the second side's facet, (k, 3).
    """

    nodes: Array
    own: Array
    other: Array

    @override
    def points(self, degree: int) -> OverlapPoints:
        made: tuple[Any, Any] = basix.make_quadrature(basix.CellType.interval, _DEGREE)
        places = made[0][:, 0]
        return self.sampled(np.column_stack([1.0 - places, places]), made[1], np.arange(len(self.first)))

    @override
    def sampled(self, rule: Array, shares: Array, chosen: Integers) -> OverlapPoints:
        straight = super().sampled(rule, shares, chosen)
        each = np.repeat(chosen, len(rule))
        s, ends = straight.on_first[:, 1], self.on_first[each, :, 1]
        t = _where(self.other[each], _place(self.own[each], s))
        part = np.tile(shares, len(chosen)) * (ends[:, 1] - ends[:, 0])
        speed = np.linalg.norm(curved_shapes.slopes(self.nodes[each], straight.on_first)[:, 0], axis=1)
        return replace(straight, weights=part * speed, on_second=np.column_stack([1.0 - t, t]))


def in_plane(first: Facets, second: Facets, thresholds: CompositionThresholds = DEFAULT) -> CurvedOverlaps:
    """The intersections of the facets of two sides.

    Args:
        first: the side onto which is projected.
        second: the other one.
        thresholds: which facets face each other, and what is rounding.
    """
    chords = facet_overlaps.in_plane(first, second, thresholds)
    nodes, own = first.points[chords.first], _along(first, chords.first, first.points[chords.first])
    other = _along(first, chords.first, second.points[chords.second])
    places = chords.on_first[:, :, 1]
    s, t = (np.stack([_where(of, places[:, end]) for end in (0, 1)], axis=1) for of in (own, other))
    return CurvedOverlaps(
        first=chords.first,
        second=chords.second,
        areas=chords.areas,
        on_first=np.stack([1.0 - s, s], axis=2),
        on_second=np.stack([1.0 - t, t], axis=2),
        covered=chords.covered,
        nodes=nodes,
        own=own,
        other=other,
    )


def _along(first: Facets, facets: Integers, points: Array) -> Array:
    """The places of points (k, n, 2) along the chords of the first side's facets, (k, n)."""
    start, end = np.moveaxis(first.corners[facets], 1, 0)
    chord = end - start
    return np.asarray(np.einsum("knd,kd->kn", points - start[:, None], chord) / np.sum(chord**2, axis=1)[:, None])


def _place(of: Array, s: Array) -> Array:
    """The place along the chord (p,) at a reference coordinate, of both ends and the middle (p, 3)."""
    start, end, middle = of.T
    return np.asarray(start + (end - start) * s + 4.0 * s * (1.0 - s) * (middle - (start + end) / 2))


def _where(of: Array, place: Array) -> Array:
    """The reference coordinate (p,) at a place along the chord, of both ends and the middle (p, 3)."""
    start, end, middle = of.T
    bend = 4.0 * (middle - (start + end) / 2)
    speed = end - start + bend  # at the start
    root = np.sqrt(np.maximum(speed**2 - 4.0 * bend * (place - start), 0.0))
    return np.asarray(2.0 * (place - start) / (speed + np.copysign(root, speed)))
