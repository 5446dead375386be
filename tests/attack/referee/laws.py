"""The laws of docs/laws.md, written down anew: tractions, energies, growth and peak, without the package.

A law here is a continuous piecewise part and a table of jumps, so that one smoothing rule serves all of them:
a jump c at a is c times a step, and smoothed c p'(x - a; ε/|c|) with the plus function p.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def _steps(t: Array, width: float, kind: str) -> Array:
    """p'(t; e) of the plus functions of docs/laws.md."""
    z = np.clip(t / width, -1e8, 1e8)
    if kind == "quadratic":
        return np.clip(z + 0.5, 0.0, 1.0)
    if kind == "chks":
        return (1.0 + z / np.hypot(z, 2.0)) / 2.0
    return 1.0 / (1.0 + np.exp(-np.clip(z, -700.0, 700.0)))


def _pluses(t: Array, width: float, kind: str) -> Array:
    """The plus functions p(t; e) themselves."""
    z = np.abs(np.clip(t / width, -1e8, 1e8))
    if kind == "quadratic":
        rest = 0.5 * np.maximum(0.5 - z, 0.0) ** 2
    elif kind == "chks":
        rest = 2.0 / (np.hypot(z, 2.0) + z)
    else:
        rest = np.log1p(np.exp(-np.minimum(z, 700.0)))
    return np.asarray(np.maximum(t, 0.0) + width * rest)


@dataclass(frozen=True)
class Law:
    """A law of one displacement x.

    Attributes:
        breaks: where the slope or the traction changes, (k,), increasing.
        left: traction left of each break.
        right: traction right of each break.
        slopes: of the traction before, between and after the breaks, (k + 1,).
        decay: amplitude and length of an exponential part -sign(x) a (1 - exp(-|x|/d)).
        smoothing: name and ε in N/m; None for the exact law.
        even: whether the traction is odd.
        falls: whether G is curved (an exponential part, a falling slope).
    """

    breaks: Array
    left: Array
    right: Array
    slopes: Array
    decay: tuple[float, float] = (0.0, 1.0)
    smoothing: tuple[str, float] | None = None
    paper: tuple[float, float, float] | None = None
    even: bool = True
    exact: Law | None = field(default=None, repr=False)

    @property
    def jumps(self) -> Array:
        """R - L at each break."""
        return np.asarray(self.right - self.left)

    @property
    def scale(self) -> float:
        """Its largest traction at the breaks; 0 for a law that is linear throughout."""
        return float(np.abs(np.concatenate([self.left, self.right, [self.decay[0]]])).max())

    @property
    def stiffness(self) -> float:
        """Of a law that is linear throughout, else 0."""
        linear = not self.jumps.any() and np.all(self.slopes == self.slopes[0]) and not self.decay[0]
        return float(self.slopes[0]) if linear else 0.0

    def side(self, x: Array, which: str) -> Array:
        """One-sided limit of the traction, 'left' or 'right'."""
        if self.paper:
            return self._paper_side(x, which)
        base = self._polyline(x, which)
        if self.smoothing:
            kind, eps = self.smoothing
            for a, c in zip(self.breaks, self.jumps, strict=True):
                if c:
                    stepped = (x > a) if which == "left" else (x >= a)
                    base = base + c * (_steps(x - a, eps / abs(c), kind) - stepped)
        drop, length = self.decay
        return np.asarray(base - drop * np.sign(x) * -np.expm1(-np.abs(x) / length)) if drop else base

    def _polyline(self, x: Array, which: str) -> Array:
        i = np.searchsorted(self.breaks, x, side="left" if which == "left" else "right")
        anchor = self.breaks[np.maximum(i - 1, 0)]
        at = np.where(i > 0, self.right[np.maximum(i - 1, 0)], self.left[0])
        return np.asarray(at + np.where(self.slopes[i] != 0.0, self.slopes[i] * (x - anchor), 0.0))

    def _paper_side(self, x: Array, which: str) -> Array:
        gamma1, gamma2, delta = self.paper or (0.0, 0.0, 1.0)
        eps, slope, y = self.smoothing[1] if self.smoothing else 0.0, gamma1 / delta, np.abs(x)
        share = np.clip(0.5 * slope * y * (y - delta) / eps + 0.5, 0.0, 1.0)
        traction = (1.0 - share) * slope * y + share * gamma2
        positive = (x > 0) if which == "left" else (x >= 0)
        return np.where(positive, traction, -traction)

    def interval(self, x: Array, slack: float) -> tuple[Array, Array]:
        """Clarke's interval over all points within ``slack`` of x."""
        inside = [np.clip(b, x - slack, x + slack) for b in np.append(self.breaks, 0.0)]
        places = [x - slack, x, x + slack, *inside]
        values = np.array([self.side(p, w) for p in places for w in ("left", "right")])
        return values.min(axis=0), values.max(axis=0)

    def value(self, x: Array) -> Array:
        """j(x), with j(0) = 0 for the exact law."""
        if self.paper:
            gamma1, gamma2, delta = self.paper
            g1, g2 = -gamma1 / (2 * delta) * x**2, -gamma2 * np.abs(x)
            assert self.smoothing is not None
            return np.asarray(-(g1 + _pluses(g2 - g1, self.smoothing[1], "quadratic")))
        cuts = np.unique(np.concatenate([self.breaks, [0.0]]))
        total = np.zeros_like(x)
        for low, high in itertools.pairwise([-np.inf, *cuts, np.inf]):
            a, b = np.clip(np.minimum(x, 0.0), low, high), np.clip(np.maximum(x, 0.0), low, high)
            b, a = np.where(a < b, b, 0.0), np.where(a < b, a, 0.0)
            middle = 0.5 * (a + b)
            total = total + np.where(b > a, (b - a) * self._polyline(middle, "right"), 0.0)
        total = np.sign(x) * total
        if self.smoothing:
            kind, eps = self.smoothing
            for a, c in zip(self.breaks, self.jumps, strict=True):
                if c:
                    total = total + c * (_pluses(x - a, eps / abs(c), kind) - np.maximum(x - a, 0.0))
        drop, length = self.decay
        y = np.abs(x)
        return np.asarray(total - drop * (y + length * np.expm1(-y / length)))

    def growth(self) -> tuple[float, float]:
        """j^∞ of the exact law in the directions -1 and +1."""
        minus = -np.inf * np.sign(-self.slopes[0]) if self.slopes[0] else -self.left[0]
        plus = np.inf * np.sign(self.slopes[-1]) if self.slopes[-1] else self.right[-1]
        return float(minus - self.decay[0]), float(plus - self.decay[0])

    def peak(self) -> tuple[float, float]:
        """Sup j⁰(x; ∓1) of the exact law over all x."""
        limits = np.concatenate([self.left, self.right])
        minus, plus = self.growth()
        return max(minus, float(np.max(-limits))), max(plus, float(np.max(limits)))


def graph(points: list[list[float]], *, one_sided: bool = False) -> Law:
    """The law through (displacement ≥ 0, traction), odd or zero for x < 0, constant after the last point."""
    ahead: list[tuple[float, float, float]] = []
    for x, group in itertools.groupby(points, key=lambda p: p[0]):
        values = [p[1] for p in group]
        ahead.append((x, values[0], values[-1]))
    zero, rest = ahead[0], ahead[1:]
    # a single nonzero traction at 0 is the right limit; two are 0 and the right limit
    right0 = zero[2]
    if one_sided:
        table = [(0.0, 0.0, right0), *rest]
    else:
        table = [(-x, -r, -left) for x, left, r in reversed(rest)] + [(0.0, -right0, right0), *rest]
    breaks, left, right = (np.array(column, dtype=float) for column in zip(*table, strict=True))
    inner = (left[1:] - right[:-1]) / np.diff(breaks)
    return Law(breaks, left, right, np.concatenate([[0.0], inner, [0.0]]), even=not one_sided)


def _literal(table: dict[str, Any]) -> Law:
    gamma1, gamma2, delta = (float(table[k]) for k in ("gamma1", "gamma2", "delta"))
    crossing = 2.0 * delta * gamma2 / gamma1
    return Law(
        np.array([0.0, crossing]),
        np.array([gamma2, 2.0 * gamma2]),
        np.array([0.0, gamma2]),
        np.array([0.0, gamma1 / delta, 0.0]),
        even=False,
    )


def _sawtooth(table: dict[str, Any]) -> Law:
    n, delta = int(table["drops"]), float(table["delta"])
    peak, residual = float(table["peak_traction"]), float(table["residual_traction"])
    points = [[0.0, 0.0]]
    for k in range(1, n + 1):
        points += [[k * delta, residual + (peak - residual) * (n + 1 - k) / n], [k * delta, residual]]
    return graph(points)


def _exponential(table: dict[str, Any]) -> Law:
    peak, residual = float(table["peak_traction"]), float(table["residual_traction"])
    one = graph([[0.0, peak]])
    return Law(one.breaks, one.left, one.right, one.slopes, decay=(peak - residual, float(table["delta"])))


def _spring(table: dict[str, Any]) -> Law:
    zero = np.zeros(1)
    return Law(zero, zero, zero, np.full(2, float(table["stiffness"])))


def exact_law(table: dict[str, Any]) -> Law:
    """The law of a scene's table."""
    name = table["law"]
    if name == "graph":
        return graph(table["points"], one_sided=bool(table.get("one_sided", False)))
    if name == "quadratic_linear":
        delta = table["delta"]
        return graph([[0.0, 0.0], [delta, table["gamma1"]], [delta, table["gamma2"]]])
    if name == "tresca":
        return graph([[0.0, table["yield_traction"]]])
    makers = {"quadratic_linear_literal": _literal, "sawtooth": _sawtooth, "exponential": _exponential}
    return makers[name](table) if name in makers else _spring(table)


def law_of(table: dict[str, Any], solver: dict[str, Any]) -> Law:
    """The law that a scene solves: smoothed where its solver table says so (``epsilon_absolute`` only)."""
    law = exact_law(table)
    if "smoothing" not in solver or law.stiffness:
        return law
    kind, eps = str(solver["smoothing"]), float(solver["epsilon_absolute"])
    paper = (table["gamma1"], table["gamma2"], table["delta"]) if kind == "paper" else None
    return Law(law.breaks, law.left, law.right, law.slopes, law.decay, (kind, eps), paper, law.even, law)
