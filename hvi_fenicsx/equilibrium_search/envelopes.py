"""Convex envelopes of laws on a box: convex parts of their chains, and chords that touch these.

A chain of parabolas is an array (k, 6) of its arcs, each `low, high, anchor, value, traction, slope`. Neighbouring arcs
that are convex together are one run. The hull of the runs, from left to right, is found as that of points (Andrew 1979,
Information Processing Letters 9), with common tangents in place of chords.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import cast

import numpy as np

from ..typing import Array, Integers, Mask
from .arcs import INF, ArcTable, apart
from .thresholds import LIMITS

LOW, HIGH = 0, 1


@dataclass(slots=True)
class _Piece:
    """A run of the hull: from where it is touched, the slope of the chord that leads there, and where it is left."""

    run: Run
    start: float
    chord: float
    end: float


def envelopes(arcs: ArcTable, low: Array, high: Array, added: Array) -> list[Array]:
    """The convex envelopes of chains plus ½ d x² on intervals: chains whose tractions do not fall, (k, 6) each.

    Args:
        arcs: the n chains.
        low: of the intervals, finite, (n,).
        high: of the intervals, finite, (n,).
        added: d, (n,).
    """
    table, meets = _on_box(arcs, low, high, added)
    falls, breaks = _falls(table, meets)
    first, count = np.argmax(meets, axis=1), meets.sum(axis=1)
    result = []
    for i, (begin, end) in enumerate(zip(first.tolist(), (first + count).tolist(), strict=True)):
        rows = table[i, begin:end]
        if falls[i, begin:end].any() or breaks[i, begin : end - 1].any():
            rows = _hull(_runs(rows, falls[i, begin:end], breaks[i, begin : end - 1]))
        result.append(rows)
    return result


def _on_box(arcs: ArcTable, low: Array, high: Array, added: Array) -> tuple[Array, Mask]:
    """All arcs on the box, plus ½ d x², (n, m, 6), and which of them meet it, (n, m)."""
    begin, end = np.maximum(arcs.low, low[:, None]), np.minimum(arcs.high, high[:, None])
    a, d = arcs.anchors, added[:, None]
    values, tractions = arcs.values + 0.5 * d * a * a, arcs.tractions + d * a
    table = np.stack([begin, end, a, values, tractions, arcs.slopes + d], axis=-1)
    for i in np.flatnonzero(low >= high):
        k = arcs.at(low)[i]
        off = low[i] - a[i, k]
        value = values[i, k] + (tractions[i, k] + 0.5 * table[i, k, 5] * off) * off
        table[i, k] = low[i], low[i], low[i], value, tractions[i, k] + table[i, k, 5] * off, 0.0
    return table, arcs.meets(low, high)


def _falls(table: Array, meets: Mask) -> tuple[Mask, Mask]:
    """Which arcs fall, and after which the traction drops by more than rounding."""
    low, high, anchor, _, traction, slope = np.moveaxis(table, -1, 0)
    with np.errstate(invalid="ignore", over="ignore"):
        before, after = (traction + slope * (x - anchor) for x in (high, low))
        sizes = np.maximum(np.abs(traction), np.abs(slope * anchor))
        size = np.maximum(np.maximum(np.abs(before), sizes)[:, :-1], np.abs(traction[:, 1:]))
        drops = after[:, 1:] < before[:, :-1] - LIMITS.rounding * size
    return meets & (slope < 0.0), meets[:, :-1] & meets[:, 1:] & drops


def _runs(rows: Array, falls: Mask, drops: Mask) -> list[Run]:
    """Convex arcs joined where their traction does not drop; of falling arcs points that may be on the hull."""
    joined = ~(falls[:-1] | falls[1:] | drops)
    cuts: Integers = np.concatenate([[0], np.flatnonzero(~joined) + 1, [len(rows)]])
    risen = _risen(rows)
    runs = []
    for begin, end in itertools.pairwise(map(int, cuts)):
        if not falls[begin]:
            runs.append(Run.of(rows[begin:end]))
            continue
        if begin == 0 or (falls[begin - 1] and risen[begin - 1]):
            runs.append(_point(rows[begin], LOW))
        if end == len(rows):
            runs.append(_point(rows[begin], HIGH))
    return runs


def _risen(rows: Array) -> Mask:
    """After which arcs the traction jumps upwards, rounding included; two falling ones may meet on the hull there."""
    _, high, anchor, _, traction, slope = rows[:-1].T
    after = rows[1:, 4] + rows[1:, 5] * (rows[1:, LOW] - rows[1:, 2])
    before = traction + slope * (high - anchor)
    return np.asarray(after > before + LIMITS.rounding * np.maximum(np.abs(before), np.abs(slope * anchor)))


def _point(arc: Array, end: int) -> Run:
    """One end of an arc."""
    x, off = arc[end], arc[end] - arc[2]
    return Run.of(np.array([[x, x, x, arc[3] + (arc[4] + 0.5 * arc[5] * off) * off, 0.0, 0.0]]))


def _hull(runs: Sequence[Run]) -> Array:
    """The hull of runs from left to right."""
    hull: list[_Piece] = []
    for run in runs:
        chord, touch = -np.inf, run.low
        while hull:
            top = hull[-1]
            chord, top.end, touch = tangent(top.run, top.start, run)
            if len(hull) == 1 or chord >= top.chord:
                break
            hull.pop()
        hull.append(_Piece(run, touch, chord, run.high))
    return np.concatenate(_parts(hull))


def _parts(hull: Sequence[_Piece]) -> list[Array]:
    """Runs and chords of a hull; those that are as short as rounding makes them are left out."""
    result: list[Array] = []
    for piece, following in zip(hull, [*hull[1:], None], strict=True):
        if apart(piece.start, piece.end):
            result.append(_between(piece))
        else:
            piece.end = piece.start
        if following is None:
            continue
        if apart(piece.end, following.start):
            value = piece.run.at(piece.end)
            result.append(np.array([[piece.end, following.start, piece.end, value, following.chord, 0.0]]))
        else:
            following.start = piece.end
    return result or [hull[0].run.rows]


def _between(piece: _Piece) -> Array:
    """The arcs of a run from where it is touched to where it is left; none as short as rounding."""
    run, start, end = piece.run, piece.start, piece.end
    first, last = bisect_left(run.highs, start), min(bisect_left(run.highs, end), len(run.highs) - 1)
    while first < last and not apart(start, run.highs[first]):
        first += 1
    while last > first and not apart(run.highs[last - 1], end):
        last -= 1
    rows = run.rows[first : last + 1].copy()
    rows[0, LOW], rows[-1, HIGH] = start, end
    return rows


@dataclass(frozen=True, slots=True)
class Run:
    """A convex chain of arcs on a finite interval, for questions about single points.

    Attributes:
        rows: the arcs `low, high, anchor, value, traction, slope`, (k, 6).
        table: the same as lists.
        highs: ends of the arcs.
        rates: tractions at both ends of each arc, which do not fall, 2 k.
    """

    rows: Array
    table: list[list[float]]
    highs: list[float]
    rates: list[float]

    @classmethod
    def of(cls, rows: Array) -> Run:
        """A chain.

        Args:
            rows: its arcs, (k, 6).
        """
        rates = rows[:, 4:5] + rows[:, 5:6] * (rows[:, :2] - rows[:, 2:3])
        table = cast("list[list[float]]", rows.tolist())
        return cls(rows, table, [arc[1] for arc in table], list(accumulate(map(float, rates.ravel()), max)))

    @property
    def low(self) -> float:
        """Begin of the interval."""
        return self.table[0][0]

    @property
    def high(self) -> float:
        """End of the interval."""
        return self.highs[-1]

    def at(self, x: float) -> float:
        """The value of the chain.

        Args:
            x: a point of the interval.
        """
        _, _, anchor, value, traction, slope = self._arc(x)
        d = x - anchor
        return value + (traction + 0.5 * slope * d) * d

    def rate(self, x: float) -> float:
        """The traction; left of a jump.

        Args:
            x: a point of the interval.
        """
        _, _, anchor, _, traction, slope = self._arc(x)
        return traction + slope * (x - anchor)

    def _arc(self, x: float) -> list[float]:
        return self.table[min(bisect_left(self.highs, x), len(self.highs) - 1)]


@dataclass(frozen=True, slots=True)
class _Support:
    """Where a line of given slope supports a run: the point, the value there, and the arc along which it moves."""

    x: float
    value: float
    arc: list[float] | None


def tangent(left: Run, start: float, right: Run) -> tuple[float, float, float]:
    """The common tangent of two runs from below: its slope, and where it touches each.

    Args:
        left: the left one.
        start: its part from here on is what counts.
        right: the right one.
    """
    if not apart(left.high, right.low):
        if not apart(start, left.high):
            return right.rates[0], start, right.low
        if right.low == right.high:
            return left.rates[-1], left.high, right.low
    low, high = _bracket(left, start, right)
    p = _root(left, start, right, low, high)
    a, b = _support(left, p, start), _support(right, p, right.low)
    if b.x > a.x:
        p = (b.value - a.value) / (b.x - a.x)
    return p, a.x, b.x


def _support(run: Run, p: float, start: float) -> _Support:
    k, inside = divmod(bisect_left(run.rates, p), 2)
    if inside:
        low, high, anchor, value, traction, slope = arc = run.table[k]
        if slope > 0.0:
            x = anchor + (p - traction) / slope
            if max(low, start) < x < high:
                return _Support(x, value + 0.5 * (p + traction) * (x - anchor), arc)
            x = max(min(x, high), low, start)
        else:
            x = max(low, start)
    else:
        x = max(run.table[k][0] if k < len(run.table) else run.high, start)
    return _Support(x, run.at(x), None)


def _difference(left: Run, start: float, right: Run, p: float) -> float:
    """a*(p) - b*(p), a* being the conjugate of a; it does not rise with p."""
    a, b = _support(left, p, start), _support(right, p, right.low)
    return (p * a.x - a.value) - (p * b.x - b.value)


def _bracket(left: Run, start: float, right: Run) -> tuple[float, float]:
    """A range of slopes with the tangent's in which both touching points move along one arc each."""
    low, high = -INF, INF
    for marks in ([left.rate(start)], left.rates, right.rates):
        begin, end = 0, len(marks)
        while begin < end:
            middle = (begin + end) // 2
            p = marks[middle]
            if p <= low or (p < high and _difference(left, start, right, p) >= 0.0):
                low, begin = max(low, p), middle + 1
            else:
                high, end = min(high, p), middle
    spread = 1.0 + max(abs(m) for m in (low, high) if math.isfinite(m))
    return (low if math.isfinite(low) else high - spread), (high if math.isfinite(high) else low + spread)


def _root(left: Run, start: float, right: Run, low: float, high: float) -> float:
    """The root of a*(p) - b*(p) in a range of p where both touching points move along one formula."""
    middle = 0.5 * (low + high)
    square, line, constant = 0.0, 0.0, 0.0
    # a*(p) = p anchor - value + (p - traction)²/(2 slope) where the point is free; p x - value(x) where it is an end
    for sign, here in ((1.0, _support(left, middle, start)), (-1.0, _support(right, middle, right.low))):
        if here.arc is not None:
            _, _, anchor, value, traction, slope = here.arc
            square += sign * 0.5 / slope
            line += sign * (anchor - traction / slope)
            constant += sign * (0.5 * traction**2 / slope - value)
        else:
            line += sign * here.x
            constant -= sign * here.value
    roots = _quadratic_roots(square, line, constant)
    inside = [r for r in roots if low <= r <= high] or roots or [middle]
    return min(inside, key=lambda r: abs(r - min(max(r, low), high)))


def _quadratic_roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a p² + b p + c."""
    if a == 0.0:
        return [-c / b] if b != 0.0 else []
    q = -0.5 * (b + math.copysign(math.sqrt(max(b * b - 4.0 * a * c, 0.0)), b))
    return [q / a, c / q] if q != 0.0 else [q / a]
