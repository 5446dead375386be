"""Convex programmes min ½ xᵀAx - bᵀx + Σ φᵢ(xᵢ) with convex chains φᵢ: an active set method, and a safe bound.

Each unknown is in a state: on an arc of its chain, or at a joint of two arcs (or an end). The states fix a linear
system; its solution says which states are next (Hintermüller, Ito and Kunisch 2002: a semismooth Newton method). Where
the states go round in circles, a proximal term is added, and taken away step by step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..typing import Array, Integers
from .arcs import ArcTable
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
        return np.asarray(force - np.clip(force, low, high))

    def _stationary(self, x: Array) -> bool:
        largest = float(np.max(np.abs(self._b), initial=1e-300))
        return bool(np.max(np.abs(self._residual(x)), initial=0.0) <= LIMITS.rounding * largest)

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
