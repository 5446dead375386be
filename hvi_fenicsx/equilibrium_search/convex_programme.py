"""Convex programmes min ½ xᵀAx - bᵀx + Σ φᵢ(xᵢ) with convex chains φᵢ: an active set method, and a safe bound.

Each unknown is in a state: on an arc of its chain, or at a joint of two arcs (or an end). The states fix a linear
system; its solution says which states are next (Hintermüller, Ito and Kunisch 2002: a semismooth Newton method). Where
the states go round in circles, a proximal term is added, and taken away step by step.

Chains that are not convex have convex envelopes on a box. The hull of their convex arcs, and of the ends of the others,
is found from left to right as that of points (Andrew 1979, Information Processing Letters 9), with common tangents in
place of chords.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import brentq

from ..laws.traction_graph import Arc
from ..typing import Array, Integers, Mask, magnitude
from .arcs import ArcTable, apart, arcs_of
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """What a programme ended with.

    Attributes:
        x: a point of the box, (n,).
        bound: no point of the box has a lower value.
    """

    x: Array
    bound: float


@dataclass(frozen=True, kw_only=True)
class _Iterate:
    """A point of the box, and whether no state changes any more."""

    x: Array
    done: bool


def never() -> bool:
    """A search goes on: nothing is to be cut short."""
    return False


def minimise(
    a: Array,
    b: Array,
    chains: ArcTable,
    start: Array,
    cut: Callable[[], bool] = never,
) -> Optimum:
    """Minimise ½ xᵀAx - bᵀx + Σ φᵢ(xᵢ).

    Args:
        a: A (n, n), symmetric, positive semidefinite but for rounding.
        b: (n,).
        chains: φ.
        start: x (n,) to begin at.
        cut: whether to end with the point that is there, since the search stops.
    """
    programme = _Programme(a, b, chains, cut)
    found = programme.active_set(np.clip(start, chains.low[:, 0], chains.last))
    if not found.done and not cut():
        found = programme.proximal(found)
    return programme.bounded(found)


class _Programme:
    """One programme."""

    def __init__(self, a: Array, b: Array, chains: ArcTable, cut: Callable[[], bool]) -> None:
        self._a, self._b, self._chains, self._cut = a, b, chains, cut
        diagonal = np.diag(a)
        self._scale = np.maximum(diagonal, 1e-3 * float(np.max(diagonal)) or 1.0)
        self._rows = np.arange(len(b))

    def active_set(self, x: Array) -> _Iterate:
        """State changes until there are none, or they go round in circles, or are too many."""
        chains, scale = self._chains, self._scale
        low, high = chains.interval(x)
        states = chains.states(x + np.clip(self._b - self._a @ x, low, high) / scale, scale)
        seen: set[bytes] = set()
        for _ in range(LIMITS.most_steps):
            solved = self._solved(states)
            if solved is None:
                return _Iterate(x=x, done=False)
            y, following = solved
            x = np.clip(y, chains.low[:, 0], chains.last)
            if np.array_equal(following, states) or self._stationary(x):
                return _Iterate(x=x, done=True)
            if following.tobytes() in seen or self._cut():
                break
            seen.add(following.tobytes())
            states = following
        return _Iterate(x=x, done=False)

    def _solved(self, states: Integers) -> tuple[Array, Integers] | None:
        """The solution of the states' linear system, and the states that follow; None where it is singular."""
        a, b, chains, rows = self._a, self._b, self._chains, self._rows
        joint, k = states % 2 == 0, states // 2
        x = np.where(joint, chains.ends[rows, k], 0.0)
        arc = np.minimum(k, chains.slopes.shape[1] - 1)
        slope = chains.slopes[rows, arc]
        offset = chains.offsets[rows, arc]
        free, held = np.flatnonzero(~joint), np.flatnonzero(joint)
        if free.size:
            matrix = a[np.ix_(free, free)]
            matrix[np.diag_indices(free.size)] += slope[free]
            right = b[free] - offset[free] - a[np.ix_(free, held)] @ x[held]
            try:
                x[free] = cho_solve(cho_factor(matrix, lower=True, check_finite=False), right, check_finite=False)
            except LinAlgError:
                return None
        t = np.where(joint, b - a @ x, offset + slope * x)
        return x, chains.states(x + t / self._scale, self._scale)

    def proximal(self, found: _Iterate) -> _Iterate:
        """The same with a proximal term, which shrinks where the states settle."""
        best, least, weight = found, self._objective(found.x), 1.0
        for _ in range(LIMITS.most_steps):
            added = weight * self._scale
            matrix, force = self._a + np.diag(added), self._b + added * best.x
            near = _Programme(matrix, force, self._chains, self._cut)
            trial = near.active_set(best.x)
            value = self._objective(trial.x)
            if value <= least:
                best, least = trial, value
            weight = weight * 0.3 if trial.done else weight * 10.0
            last = self.active_set(best.x)
            if last.done or self._cut():
                return last if last.done else best
        return best

    def _objective(self, x: Array) -> float:
        return float(0.5 * x @ (self._a @ x) - self._b @ x + self._chains.energy(x).sum())

    def _residual(self, x: Array) -> Array:
        """What is left of b - Ax - t with the t ∈ ∂φ(x) that makes it least, (n,)."""
        force = self._b - self._a @ x
        low, high = self._chains.interval(x)
        return force - np.clip(force, low, high)

    def _stationary(self, x: Array) -> bool:
        largest = float(np.max(np.abs(self._b), initial=1e-300))
        return magnitude(self._residual(x)) <= LIMITS.rounding * largest

    def bounded(self, found: _Iterate) -> Optimum:
        """The point with a bound that allows for its residual r and for rounding.

        By convexity the objective at y is at least that at x minus r·(y - x), which is least at an end of each
        interval. Rounding: machine epsilon times the number of unknowns times the sum of the sizes of all terms.
        """
        x, chains = found.x, self._chains
        value, r = self._objective(x), self._residual(x)
        lost = np.where(r > 0.0, r * (chains.last - x), r * (chains.low[:, 0] - x))
        sizes = 0.5 * np.abs(x) @ (np.abs(self._a) @ np.abs(x)) + np.abs(self._b) @ np.abs(x)
        safety = np.finfo(float).eps * len(x) * float(sizes + np.abs(chains.energy(x)).sum())
        bound = float(value - lost.sum() - safety)
        return Optimum(x=x, bound=bound)


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
    p, most, rounding = min(marks), max(marks), float(np.finfo(float).eps)
    if _apart_at(most, left, right) >= 0.0:
        p = np.inf
    elif _apart_at(p, left, right) > 0.0:
        p = brentq(_apart_at, p, most, (left, right), rounding * max(abs(p), abs(most)), 4.0 * rounding, maxiter=1000)
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
