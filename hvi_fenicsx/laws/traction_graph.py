"""The numerical kernel of all polyline laws: tables of the pieces of a traction, one for all vertices or a row each.

The rows of a table have their breaks at 0 in one column; a row with fewer breaks than others has some at -inf or inf.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from ..typing import Array, Integers, Mask

Place = TypeVar("Place", float, Array)


class Arc(NamedTuple):
    """The parabola value + traction (x - anchor) + ½ slope (x - anchor)² on low ≤ x ≤ high."""

    low: float
    high: float
    anchor: float
    value: float
    traction: float
    slope: float

    def at(self, x: Place) -> Place:
        """The value at x."""
        d = x - self.anchor
        return self.value + (self.traction + 0.5 * self.slope * d) * d

    def rate(self, x: Place) -> Place:
        """The derivative at x."""
        return self.traction + self.slope * (x - self.anchor)


@dataclass(frozen=True, eq=False)
class TractionGraph:
    """A piecewise linear traction over displacement, and its primitive with the value 0 at 0.

    Attributes:
        breaks: displacements (k,), strictly ascending, one of them 0; of a table with a row a vertex, (m, k).
        left: limits from the left at the breaks, of the same shape.
        right: limits from the right at the breaks, of the same shape.
        slopes: of the pieces, (k+1,) or (m, k+1); the first and the last piece are unbounded.
    """

    breaks: Array
    left: Array
    right: Array
    slopes: Array

    @staticmethod
    def from_points(points: npt.ArrayLike, one_sided: bool = False) -> TractionGraph:
        """Graph through points (displacement, traction) from displacement 0 on, constant after the last one.

        Args:
            points: displacements do not descend; two points at the same displacement make a jump.
            one_sided: zero for negative displacements; otherwise odd.
        """
        table = np.array(points, dtype=float)
        breaks, first = np.unique(table[:, 0], return_index=True)
        last = np.append(first[1:], len(table)) - 1
        near, far = table[first, 1], table[last, 1]
        ahead = _HalfLine(breaks, near, far, np.append((near[1:] - far[:-1]) / np.diff(breaks), 0.0))
        return _joined(_HalfLine(*np.zeros((4, 1))) if one_sided else ahead, ahead)

    @staticmethod
    def from_slopes(breaks: Array, slopes: Array, jumps: Array, start: Array) -> TractionGraph:
        """Graph of given slopes and jumps.

        Args:
            breaks: displacements (k,), strictly ascending, one of them 0.
            slopes: of the pieces, (k+1,).
            jumps: at the breaks, (k,); the one at 0 is not used.
            start: the limits (left, right) at 0, (2,).
        """
        zero = int(np.searchsorted(breaks, 0.0))
        ahead = _outward(breaks[zero:], slopes[zero + 1 :], jumps[zero:], start[1])
        return _joined(_outward(-breaks[zero::-1], slopes[zero::-1], jumps[zero::-1], -start[0]), ahead)

    @staticmethod
    def chords(places: Array, left: Array, right: Array, slopes: tuple[float, float] = (0.0, 0.0)) -> TractionGraph:
        """Graph of straight lines between places.

        Args:
            places: displacements (k,), strictly ascending, one of them 0.
            left: limits from the left there, (k,).
            right: limits from the right there, (k,).
            slopes: of the two pieces beyond.
        """
        inner = (left[1:] - right[:-1]) / np.diff(places)
        return TractionGraph(places, left, right, np.concatenate([slopes[:1], inner, slopes[1:]]))

    def scaled(self, length: float, traction: float) -> TractionGraph:
        """The graph in other units.

        Args:
            length: the unit of displacements.
            traction: the unit of tractions.
        """
        parts = (self.breaks / length, self.left / traction, self.right / traction, self.slopes * (length / traction))
        return TractionGraph(*(np.asarray(part, dtype=np.float64) for part in parts))

    def turned(self) -> TractionGraph:
        """The graph of a law that acts on -x: its traction along x."""
        parts = (-self.breaks, -self.right, -self.left, self.slopes)
        return TractionGraph(*(part[..., ::-1] for part in parts))

    def at_vertices(self, factors: Array) -> TractionGraph:
        """A row a vertex: of a law that acts on factor times x, the traction along x.

        Args:
            factors: not zero, (m,).
        """
        halves = _padded(self._ahead, self.turned()._ahead)
        size = np.abs(factors)[:, None]
        along, against = (_HalfLine(h.places / size, h.near * size, h.far * size, h.after * size**2) for h in halves)
        forward = factors[:, None] > 0.0
        return _joined(_chosen(forward, against, along), _chosen(forward, along, against))

    def remembering(self, memory: Array) -> TractionGraph:
        """A row a vertex, of bonds that have been so far: secants up to there, the graph beyond.

        Args:
            memory: the least and the greatest displacement, ≤ 0 and ≥ 0, and the tractions there, (m, 4).
        """
        rows = self if self.breaks.ndim == 2 else self.at_vertices(np.ones(len(memory)))
        low, high, low_traction, high_traction = memory.T
        ahead, behind = rows._beyond(high, high_traction), rows.turned()._beyond(-low, -low_traction)
        return _joined(behind, ahead)

    def _beyond(self, end: Array, traction: Array) -> _HalfLine:
        """The half-line x ≥ 0: up to the end a secant, then the graph, (m, k + 1)."""
        places, near, far, after = self._ahead
        been, start = end > 0.0, np.where(end > 0.0, end, 0.0)
        secant = np.divide(traction, end, out=np.zeros_like(end), where=been)
        there = self.traction(start, "right"), _taken(self.slopes, self._pieces(start)[1])
        first = (
            np.zeros_like(end),
            np.zeros_like(end),
            np.where(been, 0.0, far[:, 0]),
            np.where(been, secant, after[:, 0]),
        )
        rest = np.where(places[:, 1:] > end[:, None], places[:, 1:], np.inf), near[:, 1:], far[:, 1:], after[:, 1:]
        columns = zip(first, (np.where(been, end, np.inf), traction, *there), rest, strict=True)
        found = [np.column_stack(column) for column in columns]
        order = np.argsort(found[0], axis=1, kind="stable")  # breaks that are left out, at inf, last
        return _HalfLine(*(np.take_along_axis(part, order, axis=1) for part in found))

    def row(self, i: int) -> TractionGraph:
        """The graph of one vertex.

        Args:
            i: its number.
        """
        known = np.isfinite(self.breaks[i])
        pieces = np.append(known[: self.zero], np.append(True, known[self.zero :]))
        return TractionGraph(self.breaks[i][known], self.left[i][known], self.right[i][known], self.slopes[i][pieces])

    @property
    def _ahead(self) -> _HalfLine:
        """What is at x ≥ 0."""
        z = self.zero
        return _HalfLine(self.breaks[..., z:], self.left[..., z:], self.right[..., z:], self.slopes[..., z + 1 :])

    @property
    def jumps(self) -> Array:
        """Jumps (k,) of the traction at the breaks; most of them may be 0."""
        return self.right - self.left

    @property
    def steepest_fall(self) -> float:
        """How steeply the traction falls at most; inf where it drops."""
        return np.inf if np.any(self.jumps < 0.0) else max(0.0, -float(np.min(self.slopes)))

    @cached_property
    def zero(self) -> int:
        """Index of the break at displacement 0."""
        return int(np.argmax(np.reshape(self.breaks, (-1, self.breaks.shape[-1]))[0] == 0.0))

    @cached_property
    def _anchor(self) -> Integers:
        """For each piece the break nearest to 0. Evaluated from there, an odd graph is odd to the bit."""
        return np.append(np.arange(self.zero + 1), np.arange(self.zero, self.breaks.shape[-1]))

    @cached_property
    def _start(self) -> Array:
        """Traction of each piece at its anchor."""
        return np.concatenate([self.left[..., : self.zero + 1], self.right[..., self.zero :]], axis=-1)

    @cached_property
    def _energy(self) -> Array:
        """Primitive at the breaks, of their shape, summed outward from 0."""
        z, gaps = self.zero, np.diff(np.where(np.isfinite(self.breaks), self.breaks, 0.0), axis=-1)
        signs = np.append(-np.ones(z), np.ones(gaps.shape[-1] - z))
        starts = np.concatenate([self.left[..., 1 : z + 1], self.right[..., z:-1]], axis=-1)
        steps = starts * gaps * signs + 0.5 * self.slopes[..., 1:-1] * gaps**2
        behind, ahead = np.cumsum(steps[..., :z][..., ::-1], axis=-1)[..., ::-1], np.cumsum(steps[..., z:], axis=-1)
        return np.concatenate([behind, np.zeros_like(self.breaks[..., :1]), ahead], axis=-1)

    def traction(self, x: Array, side: str) -> Array:
        """Limit (m,) of the traction; at a break to the bit.

        Args:
            x: displacements (m,).
            side: "left" or "right".
        """
        next_break, passed = self._pieces(x)
        piece, limits = (next_break, self.left) if side == "left" else (passed, self.right)
        with np.errstate(over="ignore"):
            distance = x - _taken(self.breaks, self._anchor[piece])
            inside = _taken(self._start, piece) + _taken(self.slopes, piece) * distance
        last = limits.shape[-1] - 1
        return np.where(passed > next_break, _taken(limits, np.minimum(next_break, last)), inside)

    def _pieces(self, x: Array) -> tuple[Integers, Integers]:
        """The pieces before and behind x, (m,) each; off the breaks they are one."""
        if self.breaks.ndim == 1:
            return self.breaks.searchsorted(x), self.breaks.searchsorted(x, side="right")
        return np.sum(self.breaks < x[:, None], axis=1), np.sum(self.breaks <= x[:, None], axis=1)

    def slope(self, x: Array) -> Array:
        """Slope (m,) at x; at a break the larger of the two."""
        before, behind = self._pieces(x)
        return np.maximum(_taken(self.slopes, before), _taken(self.slopes, behind))

    def primitive(self, x: Array) -> Array:
        """Integral (m,) of the traction from 0 to x; inf where that is beyond the largest float."""
        # Of a break's two pieces the one nearer to 0, so that an even law is even to the bit.
        ahead, behind = self._pieces(x)
        piece = np.where(x < 0.0, behind, ahead)
        anchor = self._anchor[piece]
        d = x - _taken(self.breaks, anchor)
        start, half = _taken(self._start, piece), 0.5 * _taken(self.slopes, piece)
        with np.errstate(over="ignore"):
            return _taken(self._energy, anchor) + (start + half * d) * d

    @cached_property
    def table(self) -> Array:
        """The pieces of the primitive as rows of an :class:`Arc`, (k+1, 6)."""
        ends = np.concatenate([[-np.inf], self.breaks, [np.inf]])
        anchors = self.breaks[self._anchor]
        columns = (ends[:-1], ends[1:], anchors, self.primitive(anchors), self._start, self.slopes)
        return np.column_stack(columns)

    def split(self) -> tuple[TractionGraph, TractionGraph]:
        """H' and G': rising parts and upward jumps, and falling parts and downward jumps, turned round."""
        at_zero = np.array([self.left[self.zero], self.right[self.zero]])
        up, none = at_zero[1] >= at_zero[0], np.zeros(2)
        rising = TractionGraph.from_slopes(
            self.breaks, np.maximum(self.slopes, 0.0), np.maximum(self.jumps, 0.0), at_zero if up else none
        )
        falling = TractionGraph.from_slopes(
            self.breaks, np.maximum(-self.slopes, 0.0), np.maximum(-self.jumps, 0.0), none if up else -at_zero
        )
        return rising, falling


class _HalfLine(NamedTuple):
    """The breaks of a traction at x ≥ 0, the first of them 0: limits on the near and the far side, slopes behind."""

    places: Array
    near: Array
    far: Array
    after: Array


def _joined(behind: _HalfLine, ahead: _HalfLine) -> TractionGraph:
    """The graph of two half-lines; the one behind is that of the law of -x."""
    columns = (
        (-behind.places[..., :0:-1], ahead.places),
        (-behind.far[..., ::-1], ahead.near[..., 1:]),
        (-behind.near[..., :0:-1], ahead.far),
        (behind.after[..., ::-1], ahead.after),
    )
    return TractionGraph(*(np.concatenate(parts, axis=-1) for parts in columns))


def _padded(one: _HalfLine, other: _HalfLine) -> tuple[_HalfLine, _HalfLine]:
    """Two half-lines with equally many breaks, more of them at inf."""
    most = max(one.places.size, other.places.size)

    def filled(part: Array, end: float) -> Array:
        return np.append(part, np.full(most - part.size, end))

    first, second = (_HalfLine(filled(h.places, np.inf), *(filled(p, 0.0) for p in h[1:])) for h in (one, other))
    return first, second


def _chosen(first: Mask, one: _HalfLine, other: _HalfLine) -> _HalfLine:
    return _HalfLine(*(np.where(first, a, b) for a, b in zip(one, other, strict=True)))


def _taken(table: Array, columns: Integers) -> Array:
    """The entry of each vertex, (m,), of one table or of its row."""
    if table.ndim == 1:
        return table[columns]
    return np.take_along_axis(table, columns[:, None], axis=1)[:, 0]


def _outward(breaks: Array, slopes: Array, jumps: Array, start: float) -> _HalfLine:
    """The half-line that starts at 0 with the traction `start`."""
    # One sum after the other: without a jump the two limits are equal to the bit.
    sums = np.cumsum(np.append(start, np.column_stack([slopes[:-1] * np.diff(breaks), jumps[1:]])))
    near, far = np.append(start, sums[1::2]), sums[::2]
    return _HalfLine(breaks, near, far, slopes)
