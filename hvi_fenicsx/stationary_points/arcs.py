"""The energy of one unknown's laws as a chain of parabolas.

A polyline law's energy is continuous and quadratic between its breaks.
"""

from __future__ import annotations

import itertools
import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from typing import cast

import numpy as np

from ..laws.arc import Arc
from ..laws.traction_graph import TractionGraph
from ..typing import Array

INF = math.inf
ROUNDING = 1e-13
"""Drops of the traction of this relative size are rounding."""


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
    return _bonds(graph.table, weight, sign)


def scaled(arcs: Chain, weight: float, sign: float) -> Chain:
    """The energy weight * φ(sign * x) of a chain φ.

    Args:
        arcs: the chain.
        weight: a factor.
        sign: +1 or -1 (or a factor of the argument).
    """
    return _bonds(np.array(arcs), weight, sign)


def _bonds(table: Array, weight: float, sign: float) -> Chain:
    first, last, anchor, value, traction, slope = table.T
    ends = (first, last) if sign > 0 else (last, first)
    low, high, middle = (place / sign + 0.0 for place in (*ends, anchor))
    rows = np.column_stack([low, high, middle, weight * value, weight * sign * traction, weight * sign * sign * slope])
    return tuple(arcs_of(rows if sign > 0 else rows[::-1]))


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


def _sum(arcs: Iterable[Arc], lo: float, hi: float) -> Arc:
    a = lo if math.isfinite(lo) else hi if math.isfinite(hi) else 0.0
    arcs = list(arcs)
    return Arc(lo, hi, a, sum(c.at(a) for c in arcs), sum(c.rate(a) for c in arcs), sum(c.slope for c in arcs))


def on_interval(arcs: Chain, low: float, high: float) -> list[Arc]:
    """The part of a chain on an interval; a single point where low == high.

    Args:
        arcs: the chain.
        low: begin of the interval.
        high: end of the interval.
    """
    inside = [a for a in arcs if a.low < high and a.high > low]
    if not inside or low == high:
        a = next(a for a in arcs if a.low <= low <= a.high)
        return [Arc(low, low, low, a.at(low), a.rate(low), 0.0)]
    return [a._replace(low=max(a.low, low), high=min(a.high, high)) for a in inside]


def arcs_of(rows: Array) -> list[Arc]:
    """A chain that is an array of its arcs.

    Args:
        rows: (k, 6).
    """
    return list(map(Arc._make, cast("list[list[float]]", rows.tolist())))


def energy(arcs: Iterable[Arc], x: float) -> float:
    """The value of a chain.

    Args:
        arcs: the chain.
        x: a point of its interval.
    """
    return next(a for a in arcs if x <= a.high).at(x)


def apart(a: float, b: float) -> bool:
    """Whether more than rounding lies between two places.

    Args:
        a: the first.
        b: the other.
    """
    return not (math.isfinite(a) and math.isfinite(b)) or b - a > ROUNDING * max(abs(a), abs(b))
