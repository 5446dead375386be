"""The numerical kernel of all polyline laws: a piecewise linear traction over the whole line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np

from ..typing import Array, Integers
from .arc import Arc


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
    def from_points(points: Sequence[Sequence[float]], one_sided: bool = False) -> TractionGraph:
        """Graph through points (displacement, traction) from displacement 0 on, constant after the last one.

        Args:
            points: displacements do not descend; two points at the same displacement make a jump.
            one_sided: zero for negative displacements; otherwise odd.
        """
        table = np.array(points, dtype=float)
        breaks, first = np.unique(table[:, 0], return_index=True)
        last = np.append(first[1:], len(table)) - 1
        near, far = table[first, 1], table[last, 1]
        slopes = np.append((near[1:] - far[:-1]) / np.diff(breaks), 0.0)
        if one_sided:
            start = np.append(0.0, near[1:])
            return TractionGraph(breaks, start, far, np.append(0.0, slopes))
        return TractionGraph(
            np.append(-breaks[:0:-1], breaks),
            np.concatenate([-far[:0:-1], [-far[0]], near[1:]]),
            np.append(-near[:0:-1], far),
            np.append(slopes[::-1], slopes),
        )

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
        near, far = _outward(breaks[zero:], slopes[zero + 1 :], jumps[zero:], start[1])
        near_m, far_m = _outward(-breaks[zero::-1], slopes[zero::-1], jumps[zero::-1], -start[0])
        return TractionGraph(
            breaks,
            np.concatenate([-far_m[:0:-1], [start[0]], near[1:]]),
            np.concatenate([-near_m[:0:-1], [start[1]], far[1:]]),
            slopes,
        )

    @property
    def jumps(self) -> Array:
        """Jumps (k,) of the traction at the breaks; most of them may be 0."""
        return self.right - self.left

    @cached_property
    def zero(self) -> int:
        """Index of the break at displacement 0."""
        return int(np.searchsorted(self.breaks, 0.0))

    @cached_property
    def _anchor(self) -> Integers:
        """For each piece the break nearest to 0. Evaluated from there, an odd graph is odd to the bit."""
        return np.append(np.arange(self.zero + 1), np.arange(self.zero, self.breaks.size))

    @cached_property
    def _start(self) -> Array:
        """Traction of each piece at its anchor."""
        return np.append(self.left[: self.zero + 1], self.right[self.zero :])

    @cached_property
    def _energy(self) -> Array:
        """Primitive at the breaks (k,), summed outward from 0."""
        z, gaps = self.zero, np.diff(self.breaks)
        steps = (
            np.append(self.left[1 : z + 1], self.right[z:-1]) * gaps * np.append(-np.ones(z), np.ones(gaps.size - z))
        )
        steps += 0.5 * self.slopes[1:-1] * gaps**2
        return np.concatenate([np.cumsum(steps[:z][::-1])[::-1], [0.0], np.cumsum(steps[z:])])

    def traction(self, x: Array, side: str) -> Array:
        """Limit (m,) of the traction; at a break to the bit.

        Args:
            x: displacements (m,).
            side: "left" or "right".
        """
        return self._limit(x, *self._pieces(x), side)

    def right_and_slope(self, x: Array) -> tuple[Array, Array]:
        """Limit from the right and slope, as :meth:`traction` and :meth:`slope`, (m,) each.

        Args:
            x: displacements (m,).
        """
        pieces = self._pieces(x)
        return self._limit(x, *pieces, "right"), self._steeper(*pieces)

    def _pieces(self, x: Array) -> tuple[Integers, Integers]:
        """The pieces before and behind x, (m,) each; off the breaks they are one."""
        return self.breaks.searchsorted(x), self.breaks.searchsorted(x, side="right")

    def _steeper(self, before: Integers, behind: Integers) -> Array:
        return np.asarray(np.maximum(self.slopes[before], self.slopes[behind]))

    def _limit(self, x: Array, next_break: Integers, passed: Integers, side: str) -> Array:
        piece, limits = (next_break, self.left) if side == "left" else (passed, self.right)
        with np.errstate(over="ignore"):
            inside = self._start[piece] + self.slopes[piece] * (x - self.breaks[self._anchor[piece]])
        return np.where(passed > next_break, limits[np.minimum(next_break, limits.size - 1)], inside)

    def slope(self, x: Array) -> Array:
        """Slope (m,) at x; at a break the larger of the two."""
        return self._steeper(*self._pieces(x))

    def slope_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest slope on closed intervals, (m,) each.

        Args:
            low: begin of the intervals, (m,).
            high: end of the intervals, (m,).
        """
        first = np.searchsorted(self.breaks, low, side="left")
        last = np.searchsorted(self.breaks, high, side="right")
        least, most = np.sort([self.slopes[first], self.slopes[last]], axis=0)
        several = np.flatnonzero(last - first > 1)
        pieces = np.arange(len(self.slopes))
        met = (pieces >= first[several, None]) & (pieces <= last[several, None])
        least[several] = np.where(met, self.slopes, np.inf).min(axis=1)
        most[several] = np.where(met, self.slopes, -np.inf).max(axis=1)
        return least, most

    def primitive(self, x: Array) -> Array:
        """Integral (m,) of the traction from 0 to x; inf where that is beyond the largest float."""
        # Of a break's two pieces the one nearer to 0, so that an even law is even to the bit.
        ahead, behind = np.searchsorted(self.breaks, x), np.searchsorted(self.breaks, x, side="right")
        piece = np.where(x < 0.0, behind, ahead)
        anchor = self._anchor[piece]
        d = x - self.breaks[anchor]
        with np.errstate(over="ignore"):
            return np.asarray(self._energy[anchor] + (self._start[piece] + (0.5 * self.slopes[piece]) * d) * d)

    def arcs(self) -> Iterator[Arc]:
        """The pieces of the primitive."""
        yield from map(Arc._make, cast("list[list[float]]", self.table.tolist()))

    @cached_property
    def table(self) -> Array:
        """The same as an array, (k+1, 6)."""
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


def _outward(breaks: Array, slopes: Array, jumps: Array, start: float) -> tuple[Array, Array]:
    """Limits before and behind each break of a half-line that starts at 0 with the traction `start`."""
    near, far = np.full(breaks.size, start), np.full(breaks.size, start)
    rises = slopes[:-1] * np.diff(breaks)
    # One after the other: without a jump the two limits must be equal to the bit.
    for i, rise in enumerate(rises, start=1):
        near[i] = far[i - 1] + rise
        far[i] = near[i] + jumps[i]
    return near, far
