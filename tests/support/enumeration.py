"""All Clarke-stationary points of a small model problem, by brute force: the ground truth of the nonsmooth tests.

Own P1 assembly in NumPy (plane stress, right-diagonal triangles, unit square), condensed to the floor; per floor vertex
every piece and every kink of the law times contact closed or open, a small linear solve and a sign check each
(physics.md). Nothing of the package or of dolfinx is used.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int64]
_SLACK = 1e-9


@dataclass(frozen=True)
class Piece:
    """Traction = at + slope (x - anchor) on low ≤ x ≤ high; a kink (low = high) bears tractions in [at, at + jump]."""

    low: float
    high: float
    anchor: float
    at: float
    slope: float = 0.0
    jump: float = 0.0
    concave: bool = False

    @property
    def kink(self) -> bool:
        """Whether it is a single displacement."""
        return self.low == self.high


def polyline(points: Sequence[tuple[float, float]]) -> tuple[Piece, ...]:
    """The odd law through (displacement ≥ 0, traction) points, constant after the last one."""
    full = [(-x, -t) for x, t in reversed(points) if (x, t) != (0.0, 0.0)] + list(points)
    pieces = [Piece(-np.inf, full[0][0], full[0][0], full[0][1]), Piece(full[-1][0], np.inf, *full[-1])]
    for (a, s), (b, t) in itertools.pairwise(full):
        if a < b:
            pieces.append(Piece(a, b, a, s, (t - s) / (b - a)))
        elif s != t:
            pieces.append(Piece(a, a, a, min(s, t), jump=abs(t - s), concave=t < s))
    return tuple(pieces)


@dataclass(frozen=True)
class Point:
    """One stationary point: displacement at all vertices (n, 2), m, and energy, J/m.

    on_concave_kink: whether a floor vertex sits on one, so that the point is no minimiser.
    """

    u: Array
    energy: float
    on_concave_kink: bool


@dataclass(frozen=True)
class Floor:
    """A square of cells x cells on a floor, wall at the left (or none), pulled at the right, pressed at the top."""

    cells: int
    pull: float
    press: float
    law: tuple[Piece, ...]
    wall: bool = True
    modulus: float = 2.15e11
    poisson: float = 0.29

    @cached_property
    def points(self) -> Array:
        """Vertices, row by row from the floor, shape (n, 2)."""
        axis = np.linspace(0.0, 1.0, self.cells + 1)
        return np.array([(x, y) for y in axis for x in axis])

    @cached_property
    def matrix(self) -> Array:
        """Stiffness, shape (2n, 2n)."""
        k = np.zeros((2 * len(self.points),) * 2)
        for cell in self._triangles():
            dofs = np.array([2 * v + c for v in cell for c in (0, 1)])
            k[np.ix_(dofs, dofs)] += self._element(self.points[list(cell)])
        return k

    def _triangles(self) -> Iterator[tuple[int, int, int]]:
        n = self.cells + 1
        for i, j in itertools.product(range(self.cells), repeat=2):
            v = j * n + i
            yield from ((v, v + 1, v + n + 1), (v, v + n + 1, v + n))

    def _element(self, corners: Array) -> Array:
        gradients = np.linalg.inv(np.column_stack([np.ones(3), corners]))[1:]
        b = np.zeros((3, 6))
        b[0, 0::2], b[1, 1::2], b[2, 0::2], b[2, 1::2] = gradients[0], gradients[1], gradients[1], gradients[0]
        nu = self.poisson
        hooke = self.modulus / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
        return np.asarray(b.T @ hooke @ b / (2 * self.cells**2))

    @cached_property
    def weights(self) -> Array:
        """Trapezoidal weights along a side, shape (cells + 1,)."""
        w = np.full(self.cells + 1, 1.0 / self.cells)
        w[[0, -1]] /= 2
        return w

    @cached_property
    def load(self) -> Array:
        """Load vector, shape (2n,)."""
        f, n = np.zeros_like(self.points), self.cells + 1
        f[n - 1 :: n, 0] += self.pull * self.weights
        f[-n:, 1] -= self.press * self.weights
        return f.ravel()

    @cached_property
    def free(self) -> Indices:
        """Dofs that the wall leaves."""
        held = 2 * np.arange(0, len(self.points), self.cells + 1) if self.wall else []
        return np.setdiff1d(np.arange(2 * len(self.points)), held)

    @cached_property
    def tangential(self) -> Indices:
        """Dofs of u1 at floor vertices that the wall leaves."""
        return np.intersect1d(2 * np.arange(self.cells + 1), self.free)

    @cached_property
    def normal(self) -> Indices:
        """Dofs of u2 at floor vertices."""
        return 2 * np.arange(self.cells + 1) + 1

    @cached_property
    def _condensed(self) -> tuple[Array, Array, Indices]:
        """Schur complement and load on the floor's dofs, tangential ones first."""
        c = np.concatenate([self.tangential, self.normal])
        i = np.setdiff1d(self.free, c)
        inner = np.linalg.solve(self.matrix[np.ix_(i, i)], np.column_stack([self.matrix[np.ix_(i, c)], self.load[i]]))
        k, f = self.matrix[np.ix_(c, i)] @ inner[:, :-1], self.matrix[np.ix_(c, i)] @ inner[:, -1]
        return self.matrix[np.ix_(c, c)] - k, self.load[c] - f, c

    def stationary(self) -> list[Point]:
        """All of them, by energy."""
        found: list[Point] = []
        states = itertools.product(
            itertools.product(self.law, repeat=len(self.tangential)),
            itertools.product((True, False), repeat=len(self.normal)),
        )
        for pieces, closed in states:
            point = self._point(pieces, np.array(closed))
            if point is not None and not any(self._same(point, other) for other in found):
                found.append(point)
        return sorted(found, key=lambda p: p.energy)

    @staticmethod
    def _same(a: Point, b: Point) -> bool:
        return bool(np.max(np.abs(a.u - b.u)) < 1e-8 * np.max(np.abs(b.u)))

    def _point(self, pieces: Sequence[Piece], closed: npt.NDArray[np.bool_]) -> Point | None:
        """The candidate in which every floor vertex is in a given state, if the signs agree."""
        k, f, _ = self._condensed
        m, w = len(pieces), self.weights[self.tangential // 2]
        kinks = np.array([p.kink for p in pieces])
        known = np.concatenate([kinks, closed])
        x = np.concatenate([[p.anchor if p.kink else 0.0 for p in pieces], np.zeros(len(closed))])
        a, b = k.copy(), f.copy()
        for i, p in enumerate(pieces):
            a[i, i] += 0.0 if p.kink else w[i] * p.slope
            b[i] -= 0.0 if p.kink else w[i] * (p.at - p.slope * p.anchor)
        rest = np.flatnonzero(~known)
        reduced = a[rest[:, None], rest]
        try:
            x[rest] = np.linalg.solve(reduced, (b - a @ x)[rest])
        except np.linalg.LinAlgError:
            return None
        if not self._admissible(pieces, closed, x, (f - k @ x) / np.concatenate([w, self.weights])):
            return None
        if rest.size and np.linalg.cond(reduced) > 1e12:
            return None
        return self._full(x, any(p.concave and p.kink for p in pieces), m)

    def _admissible(self, pieces: Sequence[Piece], closed: npt.NDArray[np.bool_], x: Array, traction: Array) -> bool:
        m, scale = len(pieces), max(abs(self.pull), abs(self.press))
        u, t = _SLACK * scale / self.modulus, _SLACK * scale
        slips = all(
            p.at - t <= traction[i] <= p.at + p.jump + t if p.kink else p.low - u <= x[i] <= p.high + u
            for i, p in enumerate(pieces)
        )
        # closed: the floor pushes upwards, so what is left of the load pushes down; open: no penetration
        return slips and bool(np.all(np.where(closed, traction[m:] <= t, x[m:] >= -u)))

    def _full(self, x: Array, on_kink: bool, m: int) -> Point:
        _, _, c = self._condensed
        u = np.zeros(self.load.size)
        u[c] = x
        i = np.setdiff1d(self.free, c)
        u[i] = np.linalg.solve(self.matrix[np.ix_(i, i)], self.load[i] - self.matrix[np.ix_(i, c)] @ x)
        return Point(u.reshape(-1, 2), self.energy(u), on_kink)

    def energy(self, u: Array) -> float:
        """½ u·Ku - f·u + Σ w j(u1), J/m."""
        u = u.ravel()
        slips = u[2 * np.arange(self.cells + 1)]
        law = sum(w * self.work(float(x)) for w, x in zip(self.weights, slips, strict=True))
        return float(u @ self.matrix @ u / 2 - self.load @ u + law)

    def work(self, x: float) -> float:
        """j(x): the integral of the traction from 0 to x, piece by piece."""
        total, sign = 0.0, 1.0 if x >= 0 else -1.0
        low, high = min(0.0, x), max(0.0, x)
        for p in self.law:
            a, b = max(low, p.low), min(high, p.high)
            if a < b:
                total += (b - a) * (p.at + p.slope * ((a + b) / 2 - p.anchor))
        return sign * total
