"""The energy of one unknown's laws as a chain of parabolas, and the chains of all unknowns as arrays.

A polyline law's energy is continuous and quadratic between its breaks.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import cast

import numpy as np

from ..laws.traction_graph import Arc, TractionGraph
from ..typing import Array, Integers, Mask
from .thresholds import LIMITS

INF = math.inf

Chain = tuple[Arc, ...]
FREE: Chain = (Arc(-INF, INF, 0.0, 0.0, 0.0, 0.0),)
"""The energy of an unknown without a law."""


def chain(graph: TractionGraph, weight: float, sign: float) -> Chain:
    """The energy weight * j(sign * x) of one bond.

    Args:
        graph: of the traction j'.
        weight: lumped area.
        sign: +1 or -1 (or a factor of the argument).
    """
    return tuple(arcs_of(graph.along(sign).table * [1.0, 1.0, 1.0, weight, weight, weight]))


def graph_of(rows: Array) -> TractionGraph:
    """The traction of a chain over the whole line, which bends or jumps at 0 if anywhere.

    Args:
        rows: its arcs, (k, 6).
    """
    ends = rows[:-1, 1] if len(rows) > 1 else np.zeros(1)
    inner = rows if len(rows) > 1 else np.vstack([rows, rows])
    _, _, anchors, _, tractions, slopes = inner.T
    left, right = (tractions[at] + slopes[at] * (ends - anchors[at]) for at in (slice(None, -1), slice(1, None)))
    return TractionGraph(ends, left, right, slopes)


def total(chains: Sequence[Chain]) -> Chain:
    """The sum of chains over the whole line."""
    if len(chains) == 1:
        return chains[0]
    ends = sorted({end for c in chains for arc in c for end in (arc.low, arc.high)})
    highs = [[arc.high for arc in c] for c in chains]
    return tuple(
        _sum([c[bisect_left(h, hi)] for c, h in zip(chains, highs, strict=True)], lo, hi)
        for lo, hi in itertools.pairwise(ends)
    )


def _sum(arcs: Sequence[Arc], lo: float, hi: float) -> Arc:
    a = lo if math.isfinite(lo) else hi if math.isfinite(hi) else 0.0
    return Arc(lo, hi, a, sum(c.at(a) for c in arcs), sum(c.rate(a) for c in arcs), sum(c.slope for c in arcs))


def arcs_of(rows: Array) -> list[Arc]:
    """A chain that is an array of its arcs.

    Args:
        rows: (k, 6).
    """
    return list(map(Arc._make, cast("list[list[float]]", rows.tolist())))


def apart(a: float, b: float) -> bool:
    """Whether more than rounding lies between two places.

    Args:
        a: the first.
        b: the other.
    """
    return not (math.isfinite(a) and math.isfinite(b)) or b - a > LIMITS.rounding * max(abs(a), abs(b))


@dataclass(frozen=True)
class ArcTable:
    """Chains as arrays (n, m), of the whole line or of an interval; rows are padded with empty arcs at +inf.

    Attributes:
        low: begin of each arc.
        high: end of each arc.
        anchors: displacements.
        values: energies at the anchors.
        tractions: at the anchors.
        slopes: of the tractions.
    """

    low: Array
    high: Array
    anchors: Array
    values: Array
    tractions: Array
    slopes: Array

    @classmethod
    def of(cls, chains: Sequence[Sequence[Arc] | Array]) -> ArcTable:
        """Stack chains.

        Args:
            chains: as arcs, or as arrays of these (k, 6).
        """
        table = np.full((len(chains), max(len(c) for c in chains), 6), Arc(INF, INF, 0.0, 0.0, 0.0, 0.0))
        for rows, arcs in zip(table, chains, strict=True):
            rows[: len(arcs)], rows[len(arcs) :, 2:] = arcs, arcs[-1][2:]
        return cls(*np.moveaxis(table, 2, 0))

    @cached_property
    def before(self) -> Array:
        """The traction at the end of each arc; at the anchor where that is infinite."""
        return self.tractions + self.slopes * (_finite(self.high, self.anchors) - self.anchors)

    @cached_property
    def after(self) -> Array:
        """The traction at the begin of each arc; at the anchor where that is infinite."""
        return self.tractions + self.slopes * (_finite(self.low, self.anchors) - self.anchors)

    @cached_property
    def last(self) -> Array:
        """Where the chains end, (n,)."""
        return np.where(self.low < INF, self.high, -INF).max(axis=1)

    @cached_property
    def ends(self) -> Array:
        """The begin of each chain and the ends of its arcs, (n, m + 1)."""
        return np.column_stack([self.low[:, 0], self.high])

    def rows(self, i: int) -> Array:
        """The arcs of one chain, (k, 6)."""
        there = self.low[i] < INF
        return np.stack([part[i, there] for part in self._parts], axis=-1)

    def on(self, low: Array, high: Array) -> ArcTable:
        """The chains on intervals; where one is a point, its arc.

        Args:
            low: of the intervals, finite, (n,).
            high: of the intervals, finite, (n,).
        """
        meets = self.meets(low, high)
        count = meets.sum(axis=1)[:, None]
        k = np.argmax(meets, axis=1)[:, None] + np.minimum(np.arange(count.max()), count - 1)
        begin, end, *rest = (np.take_along_axis(part, k, axis=1) for part in self._parts)
        there = np.arange(count.max()) < count
        begin = np.where(there, np.maximum(begin, low[:, None]), INF)
        return ArcTable(begin, np.where(there, np.minimum(end, high[:, None]), INF), *rest)

    @property
    def _parts(self) -> tuple[Array, ...]:
        return self.low, self.high, self.anchors, self.values, self.tractions, self.slopes

    @cached_property
    def convex_part(self) -> ArcTable:
        """H of a split φ = h - g into convex parts of laws over the whole line, but for a constant and a slope."""
        return ArcTable.of([chain(graph_of(self.rows(i)).split()[0], 1.0, 1.0) for i in range(len(self.low))])

    def states(self, z: Array, scale: Array) -> Integers:
        """The state of each unknown, of convex chains: 2k at the end k, 2k + 1 on arc k.

        Args:
            z: x + t/scale, (n,).
            scale: a stiffness, (n,).
        """
        marks = np.empty((len(z), 2 * self.ends.shape[1]))
        before, after = self._around_ends
        marks[:, 0::2] = self.ends + before / scale[:, None]
        marks[:, 1::2] = self.ends + after / scale[:, None]
        return np.maximum((marks <= z[:, None]).sum(axis=1) - 1, 0)

    @cached_property
    def _around_ends(self) -> tuple[Array, Array]:
        """The tractions left and right of the ends, beyond the chains infinite, (n, m + 1) each."""
        infinite, there = np.full(len(self.low), INF), self.low < INF
        before, after = (np.where(there, side, INF) for side in (self.before, self.after))
        return np.column_stack([-infinite, before]), np.column_stack([after, infinite])

    def interval(self, x: Array) -> tuple[Array, Array]:
        """The subdifferential of each φᵢ at xᵢ, of convex chains, its ends (n,).

        Args:
            x: a point, (n,).
        """
        rows, k = np.arange(len(x)), self.at(x)
        inside = self.rates(x)
        low = np.where(x <= self.low[:, 0], -INF, inside)
        return low, np.where(x >= self.high[rows, k], self._around_ends[1][rows, k + 1], inside)

    @cached_property
    def rounding(self) -> Array:
        """The size of a jump of the traction that is rounding, (n,)."""
        return LIMITS.rounding * np.maximum(np.abs(self.before), np.abs(self.after)).max(axis=1)

    @cached_property
    def offsets(self) -> Array:
        """The tractions of the arcs, continued to zero, (n, m)."""
        return self.tractions - self.slopes * self.anchors

    def at(self, x: Array) -> Integers:
        """The arc that holds x, of the two at a joint the left one; (n,)."""
        return (self.high[:, :-1] < x[:, None]).sum(axis=1)

    def around(self, x: Array) -> tuple[Array, Array]:
        """The begin and the end of the arcs that hold x, (n,) each."""
        rows, k = np.arange(len(x)), self.at(x)
        return self.low[rows, k], self.high[rows, k]

    def energy(self, x: Array) -> Array:
        """φᵢ(xᵢ), (n,)."""
        rows, k = np.arange(len(x)), self.at(x)
        d = x - self.anchors[rows, k]
        return self.values[rows, k] + (self.tractions[rows, k] + 0.5 * self.slopes[rows, k] * d) * d

    def meets(self, low: Array, high: Array) -> Mask:
        """Which arcs have more than a point in common with a box, (n, m); where the box is a point, its arc.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        inside = (self.low < high[:, None]) & (self.high > low[:, None])
        points = np.flatnonzero(low >= high)
        inside[points] = False
        inside[points, self.at(low)[points]] = True
        return inside

    def drops(self, low: Array, high: Array) -> Array:
        """The largest drop of the traction strictly inside a box, (n,); 0 where it only rises.

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        inside = (self.high[:, :-1] > low[:, None]) & (self.high[:, :-1] < high[:, None])
        fall = np.where(inside, self.before[:, :-1] - self.after[:, 1:], 0.0)
        fall = np.where(fall > self.rounding[:, None], fall, 0.0)
        return fall.max(axis=1, initial=0.0)

    def least_slope(self, low: Array, high: Array) -> Array:
        """The least slope of the arcs that meet a box, (n,).

        Args:
            low: of the box, (n,).
            high: of the box, (n,).
        """
        return np.where(self.meets(low, high), self.slopes, np.inf).min(axis=1)

    def rates(self, x: Array) -> Array:
        """The tractions at x, at a joint those left of it, (n,)."""
        rows, k = np.arange(len(x)), self.at(x)
        return self.tractions[rows, k] + self.slopes[rows, k] * (x - self.anchors[rows, k])


def _finite(ends: Array, others: Array) -> Array:
    return np.where(np.isfinite(ends), ends, others)
