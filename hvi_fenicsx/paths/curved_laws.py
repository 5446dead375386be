"""Where curved laws differ from the chords that stand for them in the graphs, for all vertices at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..typing import Array, Integers, Mask
from .segments import Segment, between
from .thresholds import ROUNDING
from .vertex_laws import VertexLaw


class _Group:
    """One law at r vertices; on which pieces these are is changed.

    Args:
        at: the vertices' points and laws.

    Attributes:
        law: j.
        points: numbers of the vertices' points, (r,).
        rows: the vertices' laws.
        live: whether the law is on its curve, (r,).
        chords: x, traction and slope of the present chord, (r, 3).
        ends: of the present piece, (r, 2).
        inset: by how much less the law itself is taken: on a piece without end beside 1 + |x|, (r, 2).
    """

    def __init__(self, at: Sequence[tuple[int, VertexLaw]]) -> None:
        self.points: Integers = np.array([k for k, _ in at])
        self.rows = [law for _, law in at]
        laws, numbers, r = self.rows[0].laws, [law.number for law in self.rows], len(at)
        self.law, self.signs, self._weights = laws.law, laws.factors[numbers], laws.weights[numbers]
        self.live: Mask = np.zeros(r, dtype=bool)
        self.chords, self.ends, self.inset = np.zeros((r, 3)), np.zeros((r, 2)), np.zeros((r, 2))

    def enter(self, row: int, segment: Segment) -> bool:
        """Note the segment on which a vertex's point is; whether the law is on its curve there."""
        law, low, high = self.rows[row], segment.x + segment.low, segment.x + segment.high
        middle, passed = between(low, high), law.passed or (0.0, 0.0)
        self.live[row] = not segment.rise and not passed[0] < middle < passed[1]
        if self.live[row]:
            graph = law.graph
            slope = float(graph.slopes[np.searchsorted(graph.breaks, middle)])
            self.chords[row] = middle, float(graph.traction(np.array([middle]), "right")[0]), slope
            self.ends[row] = low, high
            self.inset[row] = (ROUNDING * (high - low), 0.0) if np.isfinite(high - low) else (0.0, ROUNDING)
        return bool(self.live[row])

    def lacks(self, x: Array) -> tuple[Integers, Array, Array]:
        """The points where the law is on its curve, (q,), what their chords lack, and its slope, (q,) each.

        Beyond a piece the law is continued along its tangent.
        """
        rows = np.flatnonzero(self.live)
        points, signs, weights = self.points[rows], self.signs[rows], self._weights[rows]
        (low, high), (at, start, chord), (inset, share) = self.ends[rows].T, self.chords[rows].T, self.inset[rows].T
        x = x[points]
        inset = inset + share * (1.0 + np.abs(x))
        inside = np.clip(x, low + inset, high - inset)
        traction, slope = self.law.derivatives(signs * inside)
        lacking = signs * traction + slope * (x - inside) - start - chord * (x - at)
        return points, weights * lacking, weights * (slope - chord)


class Deviations:
    """The curved laws of all points.

    Args:
        laws: of each point.
    """

    def __init__(self, laws: Sequence[Sequence[VertexLaw]]) -> None:
        self._m = len(laws)
        curved = [(k, law) for k, several in enumerate(laws) for law in several if law.curved]
        numbers = sorted({law.group for _, law in curved})
        self._groups = [_Group([(k, law) for k, law in curved if law.group == number]) for number in numbers]
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
        curved = [group.enter(row, segment) for group, row in self._at.get(k, [])]
        return any(curved)

    def values(self, x: Array) -> tuple[Array, Array]:
        """What the chords lack, and its slope, by point, (m,) each; beyond a piece continued along its tangent.

        Args:
            x: the displacements of the points, (m,).
        """
        found, slopes = np.zeros(self._m), np.zeros(self._m)
        for group in self._groups:
            points, lacking, steeper = group.lacks(x)
            np.add.at(found, points, lacking)
            np.add.at(slopes, points, steeper)
        return found, slopes

    def reach(self, x: Array, share: float) -> Array:
        """How far the points may move in one step, (m,).

        Args:
            x: the displacements of the points, (m,).
            share: of the laws' length scales and of the displacements.
        """
        found = np.full(self._m, np.inf)
        for group in self._groups:
            points = group.points[group.live]
            np.minimum.at(
                found, points, share * (group.law.length_scale / np.abs(group.signs[group.live]) + np.abs(x[points]))
            )
        return found
