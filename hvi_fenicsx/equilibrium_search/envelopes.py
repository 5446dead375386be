"""Convex envelopes of laws on a box: convex parts of their chains, and chords that touch these.

A chain of parabolas is an array (k, 6) of its arcs, each `low, high, anchor, value, traction, slope`. The hull of its
convex arcs, and of the ends of the others, is found from left to right as that of points (Andrew 1979, Information
Processing Letters 9), with common tangents in place of chords.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from ..laws.traction_graph import Arc
from ..typing import Array, Mask
from .arcs import ArcTable, apart, arcs_of
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


def convex_chains(arcs: ArcTable, low: Array, high: Array, added: Array) -> list[Array]:
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
            rows = _hull(_convex_parts(arcs_of(rows)))
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


def _convex_parts(arcs: list[Arc]) -> list[Arc]:
    """Arcs that do not fall, and of those that do the ends that no such arc has."""
    result: list[Arc] = []
    for i, arc in enumerate(arcs):
        if arc.slope >= 0.0:
            result.append(arc)
            continue
        if i == 0 or arcs[i - 1].slope < 0.0:
            result.append(_point(arc, arc.low))
        if i == len(arcs) - 1:
            result.append(_point(arc, arc.high))
    return result


def _point(arc: Arc, x: float) -> Arc:
    return Arc(x, x, x, arc.at(x), 0.0, 0.0)


@dataclass(slots=True)
class _Piece:
    """An arc of the hull: from where it is touched, the slope of the chord that leads there, and where it is left."""

    arc: Arc
    start: float
    chord: float
    end: float

    def support(self, p: float) -> tuple[float, float]:
        """Where a line of slope p supports the arc from its start on: the place, and the value there."""
        _, high, anchor, value, traction, slope = self.arc
        if slope > 0.0:
            x = anchor + (p - traction) / slope
            if self.start < x < high:
                return x, value + 0.5 * (p + traction) * (x - anchor)
            x = min(max(x, self.start), high)
        else:
            x = self.start if p <= traction else high
        return x, self.arc.at(x)


def _hull(arcs: list[Arc]) -> Array:
    """The hull of convex arcs from left to right."""
    hull = [_Piece(arcs[0], arcs[0].low, -np.inf, arcs[0].high)]
    for arc in arcs[1:]:
        following = _Piece(arc, arc.low, -np.inf, arc.high)
        while len(hull) > 1 and _apart_at(hull[-1].chord, hull[-1], following) < 0.0:
            hull.pop()
        following.chord, hull[-1].end, following.start = _tangent(hull[-1], following)
        hull.append(following)
    return np.array(_joined(hull))


def _joined(hull: list[_Piece]) -> list[Arc]:
    """Arcs and chords of a hull; those that are as short as rounding makes them are left out."""
    result: list[Arc] = []
    for piece, following in zip(hull, [*hull[1:], None], strict=True):
        if apart(piece.start, piece.end):
            result.append(piece.arc._replace(low=piece.start, high=piece.end))
        else:
            piece.end = piece.start
        if following is None:
            continue
        if apart(piece.end, following.start):
            value = piece.arc.at(piece.end)
            result.append(Arc(piece.end, following.start, piece.end, value, following.chord, 0.0))
        else:
            following.start = piece.end
    return result or [hull[0].arc]


def _apart_at(p: float, left: _Piece, right: _Piece) -> float:
    """a*(p) - b*(p), a* being the conjugate of a; it does not rise with p."""
    (x, value), (y, other) = left.support(p), right.support(p)
    return (p * x - value) - (p * y - other)


def _tangent(left: _Piece, right: _Piece) -> tuple[float, float, float]:
    """The common tangent of two arcs from below: its slope, and where it touches each."""
    a, b = left.arc, right.arc
    first = b.rate(b.low)
    if not apart(a.high, b.low) and (not apart(left.start, a.high) or a.rate(a.high) <= first):
        return first, a.high, b.low
    marks = [a.rate(left.start), a.rate(a.high), first, b.rate(b.high)]
    p, most, exact = min(marks), max(marks), np.finfo(float)
    if _apart_at(most, left, right) >= 0.0:
        p = most
    elif _apart_at(p, left, right) > 0.0:
        p = brentq(_apart_at, p, most, (left, right), exact.tiny, 4.0 * exact.eps)
    (x, value), (y, other) = left.support(p), right.support(p)
    return ((other - value) / (y - x) if y > x else p), x, y


def envelopes(problem: ScalarProblem, low: Array, high: Array, added: Array) -> ArcTable:
    """The convex envelopes of all laws with ½ d t² added, on a box; those of lengths reach to zero, and never fall.

    Args:
        problem: the problem.
        low: of the box, (n + m,), finite.
        high: of the box, (n + m,), finite.
        added: d, (n + m,).
    """
    chains = convex_chains(problem.arcs, low, high, added)
    return ArcTable.of([*chains[: problem.size], *(_risen(c) for c in chains[problem.size :])])


def _risen(chain: Array) -> Array:
    """The largest convex chain from zero on that does not fall and is nowhere above the given one, (k, 6)."""
    low, high, anchor, _, traction, slope = chain.T
    begin, end = traction + slope * (low - anchor), traction + slope * (high - anchor)
    rising = np.flatnonzero((end > 0.0) | ((slope > 0.0) & (begin >= 0.0)))
    if not rising.size:
        return np.array([_flat(chain[-1], float(high[-1]))])
    rest = chain[rising[0] :].copy()
    if begin[rising[0]] < 0.0:
        rest[0, 0] = np.clip(anchor[rising[0]] - traction[rising[0]] / slope[rising[0]], *rest[0, :2])
    turn = float(rest[0, 0])
    return np.vstack([_flat(rest[0], turn), rest]) if turn > 0.0 else rest


def _flat(arc: Array, end: float) -> list[float]:
    """A constant arc from zero on that ends on a given one."""
    anchor, value, traction, slope = map(float, arc[2:])
    away = end - anchor
    return [0.0, end, end, value + (traction + 0.5 * slope * away) * away, 0.0, 0.0]
