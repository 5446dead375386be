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

EPSILON = float(np.finfo(float).eps)


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
        return np.stack([np.bincount(self.owner, row * shares, len(self.force)) for row in self.factors])

    def prices(self, duals: Array) -> Array:
        """What the equations' duals (3, n) make of each column, (m,)."""
        return np.asarray((self.factors * duals[:, self.owner]).sum(axis=0))


@dataclass(frozen=True, kw_only=True)
class Iterate:
    """Where the method is.

    Attributes:
        x: (n,).
        duals: of the balance, the displacements and the sums, (3, n).
        shares: z, (m,).
        reduced: reduced costs, (m,).
    """

    x: Array
    duals: Array
    shares: Array
    reduced: Array

    @property
    def _parts(self) -> tuple[Array, ...]:
        return self.x, self.duals, self.shares, self.reduced

    def moved(self, step: tuple[Array, ...], close: float) -> Iterate:
        """The iterate after a step, or the share of it that leaves shares and reduced costs positive.

        Args:
            step: the changes.
            close: how near the first of these may come to zero, as a share of the way there.
        """
        way = min(close * _most(self.shares, step[2]), close * _most(self.reduced, step[3]))
        x, duals, shares, reduced = (part + way * change for part, change in zip(self._parts, step, strict=True))
        return Iterate(x=x, duals=duals, shares=shares, reduced=reduced)


def iterates(programme: Programme, most_steps: int, enough: float, close: float) -> Iterator[Iterate]:
    """The steps of the method, until it ends or rounding stops it.

    Args:
        programme: the programme.
        most_steps: how many at most.
        enough: mean product of shares and reduced costs, and residual, that end the steps.
        close: share of the way to the next zero of a share or a reduced cost.
    """
    n, z = len(programme.force), programme.start
    here = Iterate(x=np.zeros(n), duals=np.zeros((3, n)), shares=z, reduced=np.maximum(np.abs(programme.cost), 1.0))
    for _ in range(most_steps):
        yield here
        rest = _rest(programme, here)
        if here.shares @ here.reduced < enough * len(z) and max(float(np.abs(r).max()) for r in rest) < enough:
            return
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                step = _Newton(programme, here, rest).step()
        except LinAlgError:
            return
        if not all(np.all(np.isfinite(change)) for change in step):
            return
        here = here.moved(step, close)


def _rest(programme: Programme, here: Iterate) -> tuple[Array, Array, Array]:
    """What the equations lack: of columns' sums (3, n), of x (n,), of reduced costs (m,)."""
    x, u = here.x, here.duals
    right = np.stack([programme.force - programme.matrix @ x, -x, np.ones_like(x)])
    return (
        programme.sums(here.shares) - right,
        programme.curvature @ x - programme.matrix.T @ u[0] - u[1],
        here.reduced + programme.prices(u) - programme.cost,
    )


class _Newton:
    """A step of Newton's method, with its corrector."""

    def __init__(self, programme: Programme, here: Iterate, rest: tuple[Array, Array, Array]) -> None:
        self._programme, self._z, self._s, self._rest = programme, here.shares, here.reduced, rest
        self._ratio = self._z / self._s
        self._inverse = self._blocks()
        matrix, inverse = programme.matrix, self._inverse
        mixed = matrix.T * inverse[:, 0, 1]
        whole = programme.curvature + matrix.T @ (inverse[:, 0, 0][:, None] * matrix) + mixed + mixed.T
        whole[np.diag_indices_from(whole)] += inverse[:, 1, 1]
        self._factors = cho_factor(0.5 * (whole + whole.T), check_finite=False)

    def _blocks(self) -> Array:
        """The inverse of each unknown's block, (n, 3, 3)."""
        factors, owner, n = self._programme.factors, self._programme.owner, len(self._programme.force)
        blocks = np.empty((n, 3, 3))
        for i, j in np.ndindex(3, 3):
            blocks[:, i, j] = np.bincount(owner, factors[i] * factors[j] * self._ratio, n)
        size = np.trace(blocks, axis1=1, axis2=2)
        return np.asarray(np.linalg.inv(blocks + (4.0 * EPSILON * (size + 1.0))[:, None, None] * np.eye(3)))

    def step(self) -> tuple[Array, Array, Array, Array]:
        """The changes of x, duals, shares and reduced costs."""
        z, s = self._z, self._s
        _, _, dz, ds = self._solved(-z * s)
        mean = float(z @ s) / len(z)
        ahead = float((z + _most(z, dz) * dz) @ (s + _most(s, ds) * ds)) / len(z)
        return self._solved(-z * s - dz * ds + (ahead / mean) ** 3 * mean)

    def _solved(self, wanted: Array) -> tuple[Array, Array, Array, Array]:
        programme, (primal, dual, cost) = self._programme, self._rest
        v = self._times(-primal - programme.sums(wanted / self._s + self._ratio * cost))
        dx = cho_solve(self._factors, -dual + programme.matrix.T @ v[0] + v[1], check_finite=False)
        du = v - self._times(np.stack([programme.matrix @ dx, dx, np.zeros_like(dx)]))
        ds = -cost - programme.prices(du)
        return dx, du, (wanted - self._z * ds) / self._s, ds

    def _times(self, right: Array) -> Array:
        return np.asarray(np.einsum("nij,jn->in", self._inverse, right))


def _most(values: Array, change: Array) -> float:
    """The share of a change that leaves all values positive, at most one."""
    falls = change < 0.0
    with np.errstate(over="ignore"):
        return min(1.0, float((-values[falls] / change[falls]).min())) if falls.any() else 1.0
