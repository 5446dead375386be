"""Convex quadratic programmes over shares of points: a primal dual interior point method on arrays.

Minimise ½ xᵀHx + cost·z over shares z ≥ 0, where Sx + Σ tₖzₖ = f, xᵢ = Σ xₖzₖ and 1 = Σ zₖ, the sums being those of the
columns of each unknown i. Each column acts on the three equations of its own unknown alone, so a step needs blocks of
3 x 3 and one factorisation of the size of x (Mehrotra 1992, SIAM Journal on Optimization 2).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..typing import Array, Integers
from .thresholds import BalanceThresholds


@dataclass(frozen=True, kw_only=True)
class Programme:
    """A programme; everything is of the order of one.

    Attributes:
        matrix: S, (n, n).
        curvature: H, (n, n).
        force: f, (n,).
        owner: the unknown of each column, (m,).
        factors: of each column in the balance, the displacement (as -x) and the sum, (3, m).
        cost: (m,).
        start: shares to begin with, (m,).
    """

    matrix: Array
    curvature: Array
    force: Array
    owner: Integers
    factors: Array
    cost: Array
    start: Array

    def sums(self, shares: Array) -> Array:
        """What columns add to the three equations of each unknown, (3, n)."""
        n = len(self.force)
        return np.stack([np.bincount(self.owner, row * shares, n) for row in self.factors])

    def prices(self, duals: Array) -> Array:
        """What the equations' duals (3, n) make of each column, (m,)."""
        return np.asarray((self.factors * duals[:, self.owner]).sum(axis=0))


@dataclass(frozen=True, kw_only=True)
class Iterate:
    """Where the method is.

    Attributes:
        x: (n,).
        duals: of the balance, the displacements and the sums, (3, n).
        shares: (m,).
        reduced: reduced costs, (m,).
        value: of the programme at x and the shares.
        residual: the largest one of all equations.
    """

    x: Array
    duals: Array
    shares: Array
    reduced: Array
    value: float
    residual: float


def iterates(programme: Programme, thresholds: BalanceThresholds) -> Iterator[Iterate]:
    """The steps of the method, until it ends or rounding stops it.

    Args:
        programme: the programme.
        thresholds: how many steps, and what is enough.
    """
    n, z = len(programme.force), programme.start
    x: Array = np.zeros(n)
    u: Array = np.zeros((3, n))
    s: Array = np.maximum(np.abs(programme.cost), 1.0)
    for _ in range(thresholds.most_steps):
        rest = _Rest.of(programme, x, u, z, s)
        value = float(0.5 * x @ programme.curvature @ x + programme.cost @ z)
        yield Iterate(x=x, duals=u, shares=z, reduced=s, value=value, residual=rest.largest)
        if z @ s < thresholds.enough * len(z) and rest.largest < thresholds.balanced:
            return
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                changes = _Newton(programme, z, s, rest, thresholds).step()
        except LinAlgError:
            return
        if not all(np.all(np.abs(change) < thresholds.largest) for change in changes):
            return
        dx, du, dz, ds = changes
        way = min(thresholds.close * _most(z, dz), thresholds.close * _most(s, ds))
        x, u, z, s = x + way * dx, u + way * du, z + way * dz, s + way * ds


@dataclass(frozen=True, kw_only=True)
class _Rest:
    """What the equations lack: of columns' sums (3, n), of x (n,), of reduced costs (m,)."""

    primal: Array
    dual: Array
    cost: Array

    @classmethod
    def of(cls, programme: Programme, x: Array, u: Array, z: Array, s: Array) -> _Rest:
        right = np.stack([programme.force, np.zeros_like(x), np.ones_like(x)])
        return cls(
            primal=programme.sums(z) + np.stack([programme.matrix @ x, x, np.zeros_like(x)]) - right,
            dual=programme.curvature @ x - programme.matrix.T @ u[0] - u[1],
            cost=s + programme.prices(u) - programme.cost,
        )

    @property
    def largest(self) -> float:
        return float(max(np.abs(part).max() for part in (self.primal, self.dual, self.cost)))


class _Newton:
    """A step of Newton's method, with its corrector."""

    def __init__(self, programme: Programme, z: Array, s: Array, rest: _Rest, thresholds: BalanceThresholds) -> None:
        self._programme, self._z, self._s, self._rest = programme, z, s, rest
        self._ratio = z / s
        self._inverse = self._blocks(thresholds)
        matrix, inverse = programme.matrix, self._inverse
        mixed = matrix.T * inverse[:, 0, 1]
        whole = programme.curvature + matrix.T @ (inverse[:, 0, 0][:, None] * matrix) + mixed + mixed.T
        whole[np.diag_indices_from(whole)] += inverse[:, 1, 1]
        self._factors = cho_factor(0.5 * (whole + whole.T), check_finite=False)

    def _blocks(self, thresholds: BalanceThresholds) -> Array:
        """The inverse of each unknown's block, (n, 3, 3)."""
        factors, owner, n = self._programme.factors, self._programme.owner, len(self._programme.force)
        blocks = np.zeros((n, 3, 3))
        for i in range(3):
            for j in range(i + 1):
                blocks[:, i, j] = blocks[:, j, i] = np.bincount(owner, factors[i] * factors[j] * self._ratio, n)
        added = thresholds.regular * np.trace(blocks, axis1=1, axis2=2) + thresholds.least
        return np.asarray(np.linalg.inv(blocks + added[:, None, None] * np.eye(3)))

    def step(self) -> tuple[Array, Array, Array, Array]:
        """The changes of x, duals, shares and reduced costs."""
        z, s = self._z, self._s
        _, _, dz, ds = self._solved(-z * s)
        mean = float(z @ s) / len(z)
        ahead = float((z + _most(z, dz) * dz) @ (s + _most(s, ds) * ds)) / len(z)
        return self._solved(-z * s - dz * ds + (ahead / mean) ** 3 * mean)

    def _solved(self, wanted: Array) -> tuple[Array, Array, Array, Array]:
        programme, rest = self._programme, self._rest
        moved = programme.sums(wanted / self._s + self._ratio * rest.cost)
        v = self._times(-rest.primal - moved)
        dx = cho_solve(self._factors, -rest.dual + programme.matrix.T @ v[0] + v[1], check_finite=False)
        du = v - self._times(np.stack([programme.matrix @ dx, dx, np.zeros_like(dx)]))
        ds = -rest.cost - programme.prices(du)
        return dx, du, (wanted - self._z * ds) / self._s, ds

    def _times(self, right: Array) -> Array:
        return np.asarray(np.einsum("nij,jn->in", self._inverse, right))


def _most(values: Array, change: Array) -> float:
    """The share of a change that leaves all values positive, at most one."""
    falls = change < 0.0
    with np.errstate(over="ignore"):
        return min(1.0, float((-values[falls] / change[falls]).min())) if falls.any() else 1.0
