"""The convex envelope of a chain of parabolas, arc by arc."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from hvi_fenicsx.equilibrium_search.arcs import INF, ROUNDING, Chain, on_interval
from hvi_fenicsx.laws.traction_graph import Arc


def is_convex(arcs: Sequence[Arc]) -> bool:
    """Whether a chain is convex: no arc falls, and no traction drops between two arcs by more than rounding."""
    return all(a.slope >= 0.0 for a in arcs) and all(_rises(a, b) for a, b in itertools.pairwise(arcs))


def _rises(a: Arc, b: Arc) -> bool:
    """Whether the traction does not drop from an arc to the next by more than rounding."""
    before, after = a.rate(a.high), b.rate(b.low)
    size = max(abs(before), abs(a.traction), abs(b.traction), abs(a.slope * a.anchor))
    return after >= before - ROUNDING * size


def _toucher(arc: Arc, p: float) -> float:
    """Where a line of slope p supports an arc, which is convex, from below."""
    if arc.low == arc.high:
        return arc.low
    if arc.slope > 0.0:
        return min(max(arc.anchor + (p - arc.traction) / arc.slope, arc.low), arc.high)
    return arc.low if p < arc.traction else arc.high


@dataclass(slots=True)
class _Piece:
    """A convex arc of the hull: from where it is touched, and the slope of the chord that leads there."""

    arc: Arc
    start: float
    chord: float
    end: float


def envelope(arcs: Chain, low: float, high: float, added: float = 0.0) -> list[Arc]:
    """The convex envelope of a chain plus ½ added x² on an interval, as a chain with nondecreasing traction.

    Args:
        arcs: the chain.
        low: begin of the interval.
        high: end of the interval.
        added: curvature d that is added.

    Raises:
        ValueError: the chain falls without limit on an infinite interval.
    """
    pieces = [a.moved(added) if added else a for a in on_interval(arcs, low, high)]
    if is_convex(pieces):
        return pieces
    hull: list[_Piece] = []
    for arc in _convex_elements(pieces):
        _append(hull, arc)
    return _hull_chain(hull)


def _convex_elements(pieces: Sequence[Arc]) -> list[Arc]:
    """The convex arcs in order, and as points those ends of concave ones that no convex arc has."""
    result: list[Arc] = []
    for before, a, after in zip([None, *pieces[:-1]], pieces, [*pieces[1:], None], strict=True):
        if a.slope >= 0.0:
            result.append(a)
            continue
        if not (math.isfinite(a.low) and math.isfinite(a.high)):
            raise ValueError("the energy falls without limit")
        if before is None or before.slope < 0.0:
            result.append(Arc(a.low, a.low, a.low, a.at(a.low), 0.0, 0.0))
        if after is None:
            result.append(Arc(a.high, a.high, a.high, a.at(a.high), 0.0, 0.0))
    return result


def _append(hull: list[_Piece], arc: Arc) -> None:
    """Put an arc at the end of a hull; arcs that are then above a chord leave it."""
    while hull:
        top = hull[-1]
        slope, leave, touch = tangent(top.arc._replace(low=top.start), arc)
        if len(hull) > 1 and slope < top.chord:
            hull.pop()
            continue
        top.end = leave
        hull.append(_Piece(arc, touch, slope, arc.high))
        return
    hull.append(_Piece(arc, arc.low, -INF, arc.high))


def _hull_chain(hull: Sequence[_Piece]) -> list[Arc]:
    """Arcs and chords of a hull; those that are as short as rounding makes them are left out."""
    result: list[Arc] = []
    for piece, following in zip(hull, [*hull[1:], None], strict=True):
        if _apart(piece.start, piece.end):
            result.append(piece.arc._replace(low=piece.start, high=piece.end))
        else:
            piece.end = piece.start
        if following is None:
            continue
        if _apart(piece.end, following.start):
            value = piece.arc.at(piece.end)
            result.append(Arc(piece.end, following.start, piece.end, value, following.chord, 0.0))
        else:
            following.start = piece.end
    return result or [hull[0].arc]


def _apart(a: float, b: float) -> bool:
    return not (math.isfinite(a) and math.isfinite(b)) or b - a > ROUNDING * max(abs(a), abs(b))


def tangent(a: Arc, b: Arc) -> tuple[float, float, float]:
    """The common tangent of two convex arcs from below: its slope, and where it touches each.

    Args:
        a: the left arc.
        b: the right arc.
    """
    if not _apart(a.high, b.low):
        if not _apart(a.low, a.high):
            return b.rate(b.low), a.low, b.low
        if b.low == b.high or _rises(a, b):
            return a.rate(a.high), a.high, b.low
    p = _common_slope(a, b)
    left, right = _toucher(a, p), _toucher(b, p)
    if a.slope == 0.0 and a.high > a.low and p == a.traction:
        left = a.low if math.isfinite(a.low) else a.high
    if right > left:
        p = (b.at(right) - a.at(left)) / (right - left)
    return p, left, right


def _common_slope(a: Arc, b: Arc) -> float:
    """The slope p at which the supporting lines of both arcs are one: a root of a function that does not rise."""
    marks = sorted(
        {arc.rate(x) for arc in (a, b) if arc.low < arc.high for x in (arc.low, arc.high) if math.isfinite(x)}
    )
    marks = [m for m in marks if math.isfinite(m)]
    spread = 1.0 + (marks[-1] - marks[0] if marks else 0.0)
    if not marks:
        return _root(a, b, 0.0, 0.0)
    edges = [marks[0] - spread, *marks, marks[-1] + spread]
    signs = [_difference(a, b, p) >= 0.0 for p in marks]
    above = sum(signs)
    return _root(a, b, edges[above], edges[above + 1])


def _difference(a: Arc, b: Arc, p: float) -> float:
    """a*(p) - b*(p), a* being the conjugate of a."""
    x, y = _toucher(a, p), _toucher(b, p)
    if not math.isfinite(x):
        return INF
    if not math.isfinite(y):
        return -INF
    return (p * x - a.at(x)) - (p * y - b.at(y))


def _root(a: Arc, b: Arc, lo: float, hi: float) -> float:
    """The root of a*(p) - b*(p) in a range of p where both touching points move along one formula."""
    middle = 0.5 * (lo + hi)
    x, y = _toucher(a, middle), _toucher(b, middle)
    free_a, free_b = a.low < x < a.high and a.slope > 0.0, b.low < y < b.high and b.slope > 0.0
    # a*(p) = p anchor - value + (p - traction)²/(2 slope) where the point is free; p x - value(x) where it is an end
    square = (0.5 / a.slope if free_a else 0.0) - (0.5 / b.slope if free_b else 0.0)
    line, constant = 0.0, 0.0
    for arc, point, free, sign in ((a, x, free_a, 1.0), (b, y, free_b, -1.0)):
        if free:
            line += sign * (arc.anchor - arc.traction / arc.slope)
            constant += sign * (0.5 * arc.traction**2 / arc.slope - arc.value)
        else:
            line += sign * point
            constant -= sign * arc.at(point)
    roots = _quadratic_roots(square, line, constant)
    inside = [r for r in roots if lo <= r <= hi] or roots or [middle]
    return min(inside, key=lambda r: abs(r - min(max(r, lo), hi)))


def _quadratic_roots(a: float, b: float, c: float) -> list[float]:
    """Real roots of a p² + b p + c."""
    if a == 0.0:
        return [-c / b] if b != 0.0 else []
    q = -0.5 * (b + math.copysign(math.sqrt(max(b * b - 4.0 * a * c, 0.0)), b))
    return [q / a, c / q] if q != 0.0 else [q / a]
