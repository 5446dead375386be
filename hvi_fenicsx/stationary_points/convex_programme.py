"""Convex programmes min ½ xᵀAx - bᵀx + Σ φᵢ(xᵢ) with convex chains φᵢ: an active set method, and a safe bound.

Each unknown is in a state: on an arc of its chain, or at a joint of two arcs (or an end). The states fix a linear
system; its solution says which states are next (Hintermüller, Ito and Kunisch 2002: a semismooth Newton method). Where
the states go round in circles, a proximal term is added, and taken away step by step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..laws.arc import Arc
from ..typing import Array, Integers
from .thresholds import DEFAULT, ProgrammeThresholds


@dataclass(frozen=True, kw_only=True)
class Chains:
    """The convex chains of all unknowns on finite intervals, as arrays; rows are padded with arcs beyond the last end.

    Attributes:
        ends: joints and ends, ascending (n, m + 1), padded with +inf.
        anchors: of the arcs, (n, m).
        values: at the anchors, (n, m).
        tractions: at the anchors, (n, m).
        slopes: of the arcs, (n, m).
        before: traction left of each end, (n, m + 1); -inf at the first.
        after: traction right of each end, (n, m + 1); +inf at the last.
        high: the last ends, (n,).
    """

    ends: Array
    anchors: Array
    values: Array
    tractions: Array
    slopes: Array
    before: Array
    after: Array
    high: Array

    @classmethod
    def of(cls, chains: Sequence[Sequence[Arc] | Array]) -> Chains:
        """Stack chains, one of each unknown.

        Args:
            chains: with finite ends; as arcs, or as arrays of these (k, 6).
        """
        counts = np.array([len(c) for c in chains])
        m = int(counts.max())
        table = np.empty((len(chains), m, 6))
        for rows, arcs in zip(table, chains, strict=True):
            rows[: len(arcs)], rows[len(arcs) :] = arcs, arcs[-1]
        low, high, anchors, values, tractions, slopes = np.moveaxis(table, 2, 0)
        padded = np.arange(m) >= counts[:, None]
        start = np.where(padded, np.inf, tractions + slopes * (low - anchors))
        stop = np.where(padded, np.inf, tractions + slopes * (high - anchors))
        infinite = np.full(len(chains), np.inf)
        return cls(
            ends=np.column_stack([low[:, 0], np.where(padded, np.inf, high)]),
            anchors=anchors,
            values=values,
            tractions=tractions,
            slopes=slopes,
            before=np.column_stack([-infinite, stop]),
            after=np.column_stack([start, infinite]),
            high=high[np.arange(len(chains)), counts - 1],
        )

    @property
    def low(self) -> Array:
        """The first ends, (n,)."""
        return self.ends[:, 0]

    def states(self, z: Array, scale: Array) -> Integers:
        """The state of each unknown: 2k at the end k, 2k + 1 on arc k.

        Args:
            z: x + t/scale, (n,).
            scale: a stiffness, (n,).
        """
        marks = np.empty((len(z), 2 * self.ends.shape[1]))
        marks[:, 0::2] = self.ends + self.before / scale[:, None]
        marks[:, 1::2] = self.ends + self.after / scale[:, None]
        return np.asarray(np.maximum((marks <= z[:, None]).sum(axis=1) - 1, 0), dtype=np.int64)

    def arc_at(self, x: Array) -> Integers:
        """The arc that holds x, of the two at a joint the left one; (n,).

        Args:
            x: a point, (n,).
        """
        inner = self.ends[:, 1:-1] if self.ends.shape[1] > 2 else self.ends[:, :0]
        return np.asarray((inner < x[:, None]).sum(axis=1), dtype=np.int64)

    def energy(self, x: Array) -> Array:
        """φᵢ(xᵢ), (n,).

        Args:
            x: a point, (n,).
        """
        rows, k = np.arange(len(x)), self.arc_at(x)
        d = x - self.anchors[rows, k]
        return np.asarray(self.values[rows, k] + (self.tractions[rows, k] + 0.5 * self.slopes[rows, k] * d) * d)

    def interval(self, x: Array) -> tuple[Array, Array]:
        """The subdifferential of each φᵢ at xᵢ, its ends (n,).

        Args:
            x: a point, (n,).
        """
        rows, k = np.arange(len(x)), self.arc_at(x)
        inside = self.tractions[rows, k] + self.slopes[rows, k] * (x - self.anchors[rows, k])
        at_low, at_high = x <= self.low, x >= self.ends[rows, k + 1]
        low = np.where(at_low, -np.inf, inside)
        return low, np.where(at_high, self.after[rows, k + 1], inside)


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
    chains: Chains,
    start: Array,
    thresholds: ProgrammeThresholds = DEFAULT.programmes,
    cut: Callable[[], bool] = never,
) -> Optimum:
    """Minimise ½ xᵀAx - bᵀx + Σ φᵢ(xᵢ).

    Args:
        a: A (n, n), symmetric, positive semidefinite but for rounding.
        b: (n,).
        chains: φ.
        start: x (n,) to begin at.
        thresholds: how many steps, and what is rounding.
        cut: whether to end with the point that is there, since the search stops.
    """
    programme = _Programme(a, b, chains, thresholds, cut)
    found = programme.active_set(np.clip(start, chains.low, chains.high))
    if not found.done and not cut():
        found = programme.proximal(found)
    return programme.bounded(found)


class _Programme:
    """One programme."""

    def __init__(
        self, a: Array, b: Array, chains: Chains, thresholds: ProgrammeThresholds, cut: Callable[[], bool]
    ) -> None:
        self._a, self._b, self._chains, self._thresholds, self._cut = a, b, chains, thresholds, cut
        diagonal = np.diag(a)
        self._scale = np.maximum(diagonal, 1e-3 * float(np.max(diagonal)) or 1.0)
        self._rows = np.arange(len(b))

    def active_set(self, x: Array) -> _Iterate:
        """State changes until there are none, or they go round in circles, or are too many."""
        chains, scale = self._chains, self._scale
        low, high = chains.interval(x)
        states = chains.states(x + np.clip(self._b - self._a @ x, low, high) / scale, scale)
        seen: set[bytes] = set()
        for _ in range(self._thresholds.most_steps):
            solved = self._solved(states)
            if solved is None:
                return _Iterate(x=x, done=False)
            y, following = solved
            x = np.clip(y, chains.low, chains.high)
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
        offset = chains.tractions[rows, arc] - slope * chains.anchors[rows, arc]
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
        for _ in range(self._thresholds.most_proximal):
            added = weight * self._scale
            matrix, force = self._a + np.diag(added), self._b + added * best.x
            near = _Programme(matrix, force, self._chains, self._thresholds, self._cut)
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
        return np.asarray(force - np.clip(force, low, high))

    def _stationary(self, x: Array) -> bool:
        largest = float(np.max(np.abs(self._b), initial=1e-300))
        return bool(np.max(np.abs(self._residual(x)), initial=0.0) <= self._thresholds.rounding * largest)

    def bounded(self, found: _Iterate) -> Optimum:
        """The point with a bound that allows for its residual r and for rounding.

        By convexity the objective at y is at least that at x minus r·(y - x), which is least at an end of each
        interval. Rounding: machine epsilon times the number of unknowns times the sum of the sizes of all terms.
        """
        x, chains = found.x, self._chains
        value, r = self._objective(x), self._residual(x)
        lost = np.where(r > 0.0, r * (chains.high - x), r * (chains.low - x))
        sizes = 0.5 * np.abs(x) @ (np.abs(self._a) @ np.abs(x)) + np.abs(self._b) @ np.abs(x)
        safety = np.finfo(float).eps * len(x) * float(sizes + np.abs(chains.energy(x)).sum())
        bound = float(value - lost.sum() - safety)
        return Optimum(x=x, bound=bound)
