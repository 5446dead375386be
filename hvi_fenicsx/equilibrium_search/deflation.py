"""Newton's method on the graphs of the laws and bounds, kept away from points that are known: arrays only.

Each unknown moves along the graph of its law, on which a jump is a vertical piece and a bound a vertical ray; with x(s)
and t(s) on the graphs, Sx(s) + t(s) = f has minimisers and saddles as roots alike. To find others than the known ones
the equations are multiplied by 1 + 1/|s - s_k|² for each of these (deflation: Farrell, Croci, Surowiec 2020,
Optimization Methods and Software 35), which changes the length of the Newton step only. Nothing is proven by it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from ..typing import Array
from .arcs import Chain, on_interval
from .scalar_problem import ScalarProblem


@dataclass(frozen=True, kw_only=True)
class Graphs:
    """The graphs of all unknowns as polylines: (n, k), rows are padded with the last piece.

    Attributes:
        begin: parameter s at the begin of each piece, -inf at the first.
        anchor: the parameter at which x and t are given.
        x: displacements there.
        t: tractions there.
        dx: change of x by s.
        dt: change of t by s; weight |dx| + |dt| = 1.
        weight: of displacements beside tractions: the diagonal of S, hardly anything where a body moves freely, (n,).
    """

    begin: Array
    anchor: Array
    x: Array
    t: Array
    dx: Array
    dt: Array
    weight: Array

    @classmethod
    def of(cls, problem: ScalarProblem) -> Graphs:
        """The graphs of a problem without laws of lengths."""
        diagonal = np.diag(problem.stiffness)
        weight = np.maximum(diagonal, problem.thresholds.points.zero * (float(np.max(diagonal)) or 1.0))
        ends = zip(problem.chains, problem.lower, problem.upper, weight, strict=True)
        rows = [_polyline(chain, float(low), float(high), float(k)) for chain, low, high, k in ends]
        most = max(map(len, rows))
        table = np.array([row + [row[-1]] * (most - len(row)) for row in rows])
        names = ("begin", "anchor", "x", "t", "dx", "dt")
        return cls(**dict(zip(names, np.moveaxis(table, 2, 0), strict=True)), weight=weight)

    def at(self, s: Array) -> tuple[Array, Array, Array, Array]:
        """x, t, and their changes by s, (n,) each."""
        rows = np.arange(len(s))
        k = np.argmax(np.where(self.begin <= s[:, None], self.begin, -np.inf), axis=1)
        x, t, dx, dt = (part[rows, k] for part in (self.x, self.t, self.dx, self.dt))
        away = s - self.anchor[rows, k]
        return x + dx * away, t + dt * away, dx, dt

    def nearest(self, x: Array, t: Array) -> Array:
        """The parameters of the points nearest to given ones, (n,).

        Args:
            x: displacements, (n,).
            t: tractions, (n,).
        """
        end = np.concatenate([self.begin[:, 1:], np.full((len(x), 1), np.inf)], axis=1)
        k = self.weight[:, None]
        along = k**2 * self.dx * (x[:, None] - self.x) + self.dt * (t[:, None] - self.t)
        s = np.clip(self.anchor + along / (k**2 * self.dx**2 + self.dt**2), self.begin, np.maximum(end, self.begin))
        away = s - self.anchor
        off = k * np.abs(self.x + self.dx * away - x[:, None]) + np.abs(self.t + self.dt * away - t[:, None])
        return np.asarray(np.take_along_axis(s, np.argmin(off, axis=1)[:, None], axis=1)[:, 0])


def _polyline(chain: Chain, low: float, high: float, weight: float) -> list[tuple[float, ...]]:
    """The pieces of one unknown's graph: begin, anchor, x, t, dx and dt."""
    arcs = on_interval(chain, low, high)
    corners = [(x, a.rate(x)) for a in arcs for x in (a.low, a.high) if np.isfinite(x)] or [(0.0, arcs[0].rate(0.0))]
    corners = [c for c, before in zip(corners, [None, *corners[:-1]], strict=True) if c != before]
    first = (0.0, 1.0) if np.isfinite(low) else (1.0, arcs[0].slope)
    last = (0.0, 1.0) if np.isfinite(high) else (1.0, arcs[-1].slope)
    moves = [(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(corners)]
    lengths = [weight * abs(dx) + abs(dt) for dx, dt in moves]
    places = np.concatenate([[0.0], np.cumsum(lengths)])
    places -= places[np.argmin([abs(x) for x, _ in corners])]  # what is near zero must not be rounded by what is far
    starts = [(-np.inf, places[0], *corners[0])] + [(s, s, *c) for s, c in zip(places, corners, strict=True)]
    ways = [(dx / size, dt / size) for dx, dt in [first, *moves, last] if (size := weight * abs(dx) + abs(dt))]
    return [(*start, *way) for start, way in zip(starts, ways, strict=True)]


class DeflatedNewton:
    """Searches for roots other than known ones.

    Args:
        problem: without laws of lengths.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self.problem, self._graphs = problem, Graphs.of(problem)

    def root(self, start: Array, known: Iterable[Array], reach: float, attempt: int) -> Array | None:
        """A stationary point; None if none is found.

        Args:
            start: where to begin, (n,).
            known: points to keep away from, each (n,).
            reach: how far these push away, relative to the largest force.
            attempt: the method begins near the start, at another place for each number.
        """
        problem, s, size = self.problem, self._parameters(start), reach * self.problem.force_size
        away = np.array([self._parameters(x) for x in known]).reshape(-1, problem.size)
        s = s + size * np.random.default_rng(attempt).uniform(-1.0, 1.0, problem.size)
        longest = problem.thresholds.systematic.longest
        for _ in range(problem.thresholds.programmes.most_steps):
            x, t, dx, dt = self._graphs.at(s)
            if not np.all(np.isfinite(s)) or problem.is_far(x):
                return None
            rest = problem.stiffness @ x + t - problem.force
            if np.max(np.abs(rest)) <= problem.thresholds.points.zero * problem.force_size:
                return x
            try:
                step = np.linalg.solve(problem.stiffness * dx + np.diag(dt), -rest)
            except np.linalg.LinAlgError:
                return None
            s = np.asarray(s + _stretch((s - away) / size, np.asarray(step / size), longest) * step)
        return None

    def _parameters(self, x: Array) -> Array:
        problem = self.problem
        return self._graphs.nearest(x, problem.force - problem.stiffness @ x)


def _stretch(apart: Array, step: Array, longest: float) -> float:
    """By how much deflation makes a step longer or, negative, turns it round.

    Args:
        apart: differences from the known points, over the length within which these push away, (k, n).
        step: of Newton's method, over the same, (n,).
        longest: factor at most.
    """
    squares = np.sum(apart**2, axis=1)
    total = 1.0 + 2.0 * float(np.sum(apart @ step / np.maximum(squares * (1.0 + squares), 1e-300)))
    return float(np.clip(1.0 / total if total else longest, -longest, longest))
