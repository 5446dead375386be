"""Convex chains that are nowhere below those of a problem and equal to them at a point: falls are linearised there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Integers, Mask
from .scalar_problem import ArcTable


def majorants(arcs: ArcTable, low: Array, high: Array, x: Array) -> list[Array]:
    """The majorants on intervals: chains whose tractions do not fall, (k, 6) each.

    Args:
        arcs: the n chains, over the whole line.
        low: begin of the intervals, finite, (n,).
        high: end of the intervals, finite, (n,).
        x: where they are equal, in the intervals, (n,).
    """
    rows, meets = np.arange(len(x)), arcs.meets(low, high)
    first, count = np.argmax(meets, axis=1), meets.sum(axis=1)
    used = slice(int(first.min()), int((first + count).max()))
    at = np.maximum(arcs.at(x), first)
    away = x - arcs.anchors[rows, at]
    slope, traction = arcs.slopes[rows, at], arcs.tractions[rows, at]
    here = _Place(
        at=at - used.start,
        x=x,
        value=arcs.values[rows, at] + (traction + 0.5 * slope * away) * away,
        rate=traction + slope * away,
    )
    table = _table(_Pieces.on(arcs, low, high, used), here)
    return [table[i, begin - used.start :][:size] for i, (begin, size) in enumerate(zip(first, count, strict=True))]


@dataclass(frozen=True, kw_only=True)
class _Place:
    """Where the majorants touch: the arc, the place, the energy and the traction, (n,) each."""

    at: Integers
    x: Array
    value: Array
    rate: Array

    def mirrored(self, arcs: int) -> _Place:
        """The same on a line that is turned round."""
        return _Place(at=arcs - 1 - self.at, x=-self.x, value=self.value, rate=-self.rate)


@dataclass(frozen=True, kw_only=True)
class _Pieces:
    """Arcs on intervals, which do not fall: begins, ends and slopes (n, m), upward jumps between them (n, m - 1)."""

    begin: Array
    end: Array
    slope: Array
    jump: Array

    @classmethod
    def on(cls, arcs: ArcTable, low: Array, high: Array, used: slice) -> _Pieces:
        """The arcs of a table; those that are not on an interval end before they begin."""
        begin = np.maximum(arcs.low[:, used], low[:, None])
        end = np.minimum(arcs.high[:, used], high[:, None])
        jump = np.maximum(arcs.after[:, used][:, 1:] - arcs.before[:, used][:, :-1], 0.0)
        slope = np.where(end > begin, np.maximum(arcs.slopes[:, used], 0.0), 0.0)
        return cls(begin=begin, end=end, slope=slope, jump=jump)

    def mirrored(self) -> _Pieces:
        """The same on a line that is turned round."""
        begin, end = -self.end[:, ::-1], -self.begin[:, ::-1]
        return _Pieces(begin=begin, end=end, slope=self.slope[:, ::-1], jump=self.jump[:, ::-1])

    def onwards(self, here: _Place) -> tuple[Array, Array, Mask]:
        """Energies and tractions at the begins of the arcs behind that of a place, and which these are, (n, m) each."""
        ahead = np.arange(self.begin.shape[1]) > here.at[:, None]
        length = np.maximum(self.end - np.maximum(self.begin, here.x[:, None]), 0.0)
        rise = self.slope * length
        steps = np.zeros((len(length), 2 * length.shape[1]))
        steps[:, 0], steps[:, 1::2] = here.rate, rise
        steps[:, 2::2] = np.where(ahead[:, 1:], self.jump, 0.0)
        rates = np.add.accumulate(steps, axis=1)[:, ::2]
        gains = (rates + 0.5 * rise) * length
        values = np.add.accumulate(np.column_stack([here.value, gains[:, :-1]]), axis=1)
        return values, rates, ahead


def _table(pieces: _Pieces, here: _Place) -> Array:
    """The arcs of the majorants, (n, m, 6): each begins at its end that is nearer to the place."""
    values, rates, ahead = pieces.onwards(here)
    below, falls, beyond = pieces.mirrored().onwards(here.mirrored(pieces.begin.shape[1]))
    behind = beyond[:, ::-1]
    anchors = np.where(ahead, pieces.begin, np.where(behind, pieces.end, here.x[:, None]))
    values, rates = (np.where(behind, a[:, ::-1], b) for a, b in ((below, values), (-falls, rates)))
    return np.stack([pieces.begin, pieces.end, anchors, values, rates, pieces.slope], axis=-1)
