"""The numerical kernel of all polyline laws: the pieces of a traction."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from ..typing import Array, Integers

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
        breaks: displacements (k,), strictly ascending, one of them 0.
        left: limits from the left at the breaks, (k,).
        right: limits from the right at the breaks, (k,).
        slopes: of the pieces, (k+1,); the first and the last piece are unbounded.
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
        return TractionGraph(*(part[::-1] for part in parts))

    def along(self, factor: float) -> TractionGraph:
        """The graph of a law that acts on factor times x: the traction along x.

        Args:
            factor: not zero.
        """
        graph, size = self if factor > 0.0 else self.turned(), abs(factor)
        return graph.scaled(size, 1.0 / size)

    def remembering(self, memory: Array) -> TractionGraph:
        """The graph of a bond that has been so far: secants up to there, the graph beyond.

        Args:
            memory: the least and the greatest displacement, ≤ 0 and ≥ 0, and the tractions there, (4,).
        """
        low, high, low_traction, high_traction = memory
        return _joined(self.turned()._beyond(-low, -low_traction), self._beyond(high, high_traction))

    def _beyond(self, end: float, traction: float) -> _HalfLine:
        """The half-line x ≥ 0: up to the end a secant, then the graph."""
        if end <= 0.0:
            return self._ahead
        rest = (part[self._ahead.places > end] for part in self._ahead)
        _, (piece,) = self._pieces(np.array([end]))
        beyond = self.traction(np.array([end]), "right")[0], self.slopes[piece]
        start = (0.0, end), (0.0, traction), (0.0, beyond[0]), (traction / end, beyond[1])
        return _HalfLine(*map(np.append, start, rest))

    @property
    def _ahead(self) -> _HalfLine:
        """What is at x ≥ 0."""
        z = self.zero
        return _HalfLine(self.breaks[z:], self.left[z:], self.right[z:], self.slopes[z + 1 :])

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
        return int(np.argmax(self.breaks == 0.0))

    @cached_property
    def _anchor(self) -> Integers:
        """For each piece the break nearest to 0. Evaluated from there, an odd graph is odd to the bit."""
        return np.append(np.arange(self.zero + 1), np.arange(self.zero, len(self.breaks)))

    @cached_property
    def _places(self) -> Array:
        """Displacement of each anchor."""
        return self.breaks[self._anchor]

    @cached_property
    def _next(self) -> tuple[Array, Array, Array]:
        """For each piece the break at its high end, and both limits there; not a number where it has none."""
        return np.append(self.breaks, np.nan), np.append(self.left, np.nan), np.append(self.right, np.nan)

    @cached_property
    def _start(self) -> Array:
        """Traction of each piece at its anchor."""
        return np.append(self.left[: self.zero + 1], self.right[self.zero :])

    @cached_property
    def _energy(self) -> Array:
        """Primitive at the breaks, of their shape, summed outward from 0."""
        z, gaps = self.zero, np.diff(self.breaks)
        signs = np.append(-np.ones(z), np.ones(len(gaps) - z))
        starts = np.append(self.left[1 : z + 1], self.right[z:-1])
        steps = starts * gaps * signs + 0.5 * self.slopes[1:-1] * gaps**2
        return np.concatenate([np.cumsum(steps[:z][::-1])[::-1], [0.0], np.cumsum(steps[z:])])

    def traction(self, x: Array, side: str) -> Array:
        """Limit (m,) of the traction; at a break to the bit.

        Args:
            x: displacements (m,).
            side: "left" or "right".
        """
        before = self.breaks.searchsorted(x)
        at_break = self._next[0][before] == x
        piece, limits = (before, self._next[1]) if side == "left" else (before + at_break, self._next[2])
        with np.errstate(over="ignore"):
            inside = self._start[piece] + self.slopes[piece] * (x - self._places[piece])
        return np.where(at_break, limits[before], inside)

    def _pieces(self, x: Array) -> tuple[Integers, Integers]:
        """The pieces before and behind x, (m,) each; off the breaks they are one."""
        return self.breaks.searchsorted(x), self.breaks.searchsorted(x, side="right")

    def slope(self, x: Array) -> Array:
        """Slope (m,) at x; at a break the larger of the two."""
        before, behind = self._pieces(x)
        return np.maximum(self.slopes[before], self.slopes[behind])

    def primitive(self, x: Array) -> Array:
        """Integral (m,) of the traction from 0 to x; inf where that is beyond the largest float."""
        # Of a break's two pieces the one nearer to 0, so that an even law is even to the bit.
        ahead, behind = self._pieces(x)
        piece = np.where(x < 0.0, behind, ahead)
        anchor = self._anchor[piece]
        d, half = x - self._places[piece], 0.5 * self.slopes[piece]
        with np.errstate(over="ignore"):
            return self._energy[anchor] + (self._start[piece] + half * d) * d

    @cached_property
    def table(self) -> Array:
        """The pieces of the primitive as rows of an :class:`Arc`, (k+1, 6)."""
        ends = np.concatenate([[-np.inf], self.breaks, [np.inf]])
        columns = (ends[:-1], ends[1:], self._places, self.primitive(self._places), self._start, self.slopes)
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
        (-behind.places[:0:-1], ahead.places),
        (-behind.far[::-1], ahead.near[1:]),
        (-behind.near[:0:-1], ahead.far),
        (behind.after[::-1], ahead.after),
    )
    return TractionGraph(*(np.concatenate(parts) for parts in columns))


def _outward(breaks: Array, slopes: Array, jumps: Array, start: float) -> _HalfLine:
    """The half-line that starts at 0 with the traction `start`."""
    # One sum after the other: without a jump the two limits are equal to the bit.
    sums = np.cumsum(np.append(start, np.column_stack([slopes[:-1] * np.diff(breaks), jumps[1:]])))
    near, far = np.append(start, sums[1::2]), sums[::2]
    return _HalfLine(breaks, near, far, slopes)
