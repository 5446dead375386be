"""The common tangent from below of two convex chains of parabolas, one left of the other."""

from __future__ import annotations

import math
from bisect import bisect_left
from dataclasses import dataclass
from itertools import accumulate
from typing import cast

from ..typing import Array
from .arcs import INF, apart


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
