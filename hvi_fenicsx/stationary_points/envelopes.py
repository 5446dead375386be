"""Convex envelopes of laws on a box: convex parts of their chains, and chords that touch these.

A chain of parabolas is an array (k, 6) of its arcs, each `low, high, anchor, value, traction, slope`. Neighbouring arcs
that are convex together are one run. The hull of the runs, from left to right, is found as that of points (Andrew 1979,
Information Processing Letters 9), with common tangents in place of chords.
"""

from __future__ import annotations

import itertools
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers, Mask
from .arcs import ROUNDING, ArcTable, apart
from .common_tangent import Run, tangent

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
        drops = after[:, 1:] < before[:, :-1] - ROUNDING * size
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
    return np.asarray(after > before + ROUNDING * np.maximum(np.abs(before), np.abs(slope * anchor)))


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
