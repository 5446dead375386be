"""Where curved laws differ from the chords that stand for them in the graphs, for all vertices at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..laws import Superpotential
from ..typing import Array, Integers, Mask
from .segments import Segment, between
from .thresholds import FollowingThresholds
from .vertex_laws import VertexLaw


@dataclass(frozen=True, kw_only=True)
class _Live:
    """A law at the q vertices where it is on its curve.

    Attributes:
        points: numbers, (q,).
        signs: the law's argument is that times the displacement, (q,).
        weights: lumped areas, (q,).
        low: least displacement at which the law itself is taken, but for the inset, (q,).
        high: greatest one, (q,).
        inset: by how much less on pieces without end, beside 1 + |x|, (q,).
        chords: x, traction and slope of the present chords, (3, q).
    """

    points: Integers
    signs: Array
    weights: Array
    low: Array
    high: Array
    inset: Array
    chords: Array

    def lacks(self, law: Superpotential, x: Array) -> tuple[Array, Array]:
        """What the chords lack, and its slope, (q,) each; beyond a piece continued along its tangent.

        Args:
            law: j.
            x: displacements, (q,).
        """
        inset = self.inset * (1.0 + np.abs(x))
        inside = np.clip(x, self.low + inset, self.high - inset)
        at, start, chord = self.chords
        traction, slope = law.derivatives(self.signs * inside)
        lacking = self.signs * traction + slope * (x - inside) - start - chord * (x - at)
        return self.weights * lacking, self.weights * (slope - chord)


@dataclass(kw_only=True)
class _Group:
    """One law at r vertices.

    Attributes:
        law: j.
        points: numbers, (r,).
        signs: the law's argument is that times the displacement, (r,).
        weights: lumped areas, (r,).
        rows: the vertices' laws.
        live: whether the law is on its curve, (r,).
        chords: x, traction and slope of the present chord, (r, 3).
        ends: of the present piece, (r, 2).
        at: where the law is on its curve; None: not gathered since a vertex entered another piece.
    """

    law: Superpotential
    points: Integers
    signs: Array
    weights: Array
    rows: list[VertexLaw]
    live: Mask
    chords: Array
    ends: Array
    at: _Live | None = None

    def gathered(self, share: float) -> _Live:
        """The vertices where the law is on its curve."""
        if self.at is None:
            rows = np.flatnonzero(self.live)
            low, high = self.ends[rows].T
            ended = np.isfinite(high - low)
            inset = np.where(ended, share * np.where(ended, high - low, 0.0), 0.0)
            self.at = _Live(
                points=self.points[rows],
                signs=self.signs[rows],
                weights=self.weights[rows],
                low=low + inset,
                high=high - inset,
                inset=np.where(ended, 0.0, share),
                chords=self.chords[rows].T,
            )
        return self.at


class Deviations:
    """The curved laws of all points.

    Args:
        laws: of each point.
        thresholds: how far inside the ends of pieces the law is taken, and how far steps go.
    """

    def __init__(self, laws: Sequence[Sequence[VertexLaw]], thresholds: FollowingThresholds) -> None:
        self._thresholds = thresholds
        self._m = len(laws)
        curved = [(k, law) for k, several in enumerate(laws) for law in several if law.curved]
        numbers = sorted({law.group for _, law in curved})
        self._groups = [_group([(k, law) for k, law in curved if law.group == number]) for number in numbers]
        self._at: dict[int, list[tuple[_Group, int]]] = {}
        for group in self._groups:
            for row, k in enumerate(group.points):
                self._at.setdefault(int(k), []).append((group, row))

    def enter(self, k: int, segment: Segment) -> bool:
        """Note the segment on which a point is; whether a law is curved there.

        Args:
            k: the point.
            segment: the segment.
        """
        for group, row in self._at.get(k, []):
            group.at = None
            law, low, high = group.rows[row], segment.x + segment.low, segment.x + segment.high
            middle = between(low, high)
            passed = law.passed or (0.0, 0.0)
            group.live[row] = not segment.rise and not passed[0] < middle < passed[1]
            if group.live[row]:
                graph, at = law.graph, np.array([middle])
                slope = float(graph.slopes[np.searchsorted(graph.breaks, middle)])
                group.chords[row] = middle, float(graph.traction(at, "right")[0]), slope
                group.ends[row] = low, high
        return any(bool(group.live[row]) for group, row in self._at.get(k, []))

    def values(self, x: Array) -> tuple[Array, Array]:
        """What the chords lack, and its slope, by point, (m,) each; beyond a piece continued along its tangent.

        Args:
            x: the displacements of the points, (m,).
        """
        found, slopes = np.zeros(self._m), np.zeros(self._m)
        for group in self._groups:
            live = group.gathered(self._thresholds.rounding)
            if live.points.size:
                lacking, steeper = live.lacks(group.law, x[live.points])
                found += np.bincount(live.points, lacking, minlength=self._m)
                slopes += np.bincount(live.points, steeper, minlength=self._m)
        return found, slopes

    def reach(self, x: Array) -> Array:
        """How far the points may move in one step, (m,).

        Args:
            x: the displacements of the points, (m,).
        """
        found = np.full(self._m, np.inf)
        for group in self._groups:
            points = group.gathered(self._thresholds.rounding).points
            np.minimum.at(found, points, self._thresholds.reach * (group.law.length_scale + np.abs(x[points])))
        return found


def _group(rows: list[tuple[int, VertexLaw]]) -> _Group:
    laws = [law for _, law in rows]
    return _Group(
        law=laws[0].law,
        points=np.array([k for k, _ in rows]),
        signs=np.array([law.sign for law in laws]),
        weights=np.array([law.weight for law in laws]),
        rows=laws,
        live=np.zeros(len(rows), dtype=bool),
        chords=np.zeros((len(rows), 3)),
        ends=np.zeros((len(rows), 2)),
    )
