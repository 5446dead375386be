"""The programme that looks for the weights of a cell.

Each law's point (xᵢ, tᵢ) is replaced by a mean over a few points of its graph, and bounds bear what they may. The least
of xᵀMx - f·x + Σ (dᵢ xᵢ² + xᵢ tᵢ) over all such means in balance is zero at stationary points; the duals of the balance
are weights that prove as much of the cell as can be proven in this way. What is missing in the balance has a price.

The method is an interior point method with a corrector (Mehrotra 1992, SIAM Journal on Optimization 2). The three
equations of each unknown are eliminated: what is factorised has the size of S.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..typing import Array, Integers, magnitude
from .relaxation import Relaxation
from .scalar_problem import Box, ScalarProblem
from .thresholds import EPSILON, LIMITS
from .weighed_balance import Graphs, Split, weighed


class BalanceProgramme:
    """The programme of one cell.

    Args:
        problem: the problem.
        split: M and D.
        low: of the cell, (n,), finite.
        high: of the cell, (n,), finite.
    """

    def __init__(self, problem: ScalarProblem, split: Split, low: Array, high: Array) -> None:
        self._problem, self._split, self._low, self._high = problem, split, low, high
        self._owner, self._x, self._t = _points(Graphs.of(problem, low, high), split.diagonal)
        self._middle, self._half = 0.5 * (low + high), 0.5 * (high - low)
        below, above = np.flatnonzero(low <= problem.lower), np.flatnonzero(high >= problem.upper)
        self._pushed = np.concatenate([below, above])
        self._push = np.concatenate([-np.ones(below.size), np.ones(above.size)])
        self._bounds = np.concatenate([problem.lower[below], problem.upper[above]])
        self._force_scale, self._unit = self._scales()
        self.programme = self._made()

    def _scales(self) -> tuple[Array, float]:
        """The scale of each force, and that of the energy."""
        n = self._problem.size
        most, least = np.full(n, -np.inf), np.full(n, np.inf)
        np.maximum.at(most, self._owner, self._t)
        np.minimum.at(least, self._owner, self._t)
        forces = np.maximum(most - least, np.abs(self._problem.stiffness) @ self._half)
        forces = np.maximum(forces, LIMITS.enough * float(forces.max()) + 1e-300)
        largest = np.maximum(np.abs(most), np.abs(least)) + np.abs(self._problem.force)
        return forces, float(largest @ self._half) + 1e-300

    def _made(self) -> Programme:
        problem, n, scale, unit = self._problem, self._problem.size, self._force_scale, self._unit
        matrix, middle, half, owner = self._split.matrix, self._middle, self._half, self._owner
        away = self._x - middle[owner]
        along = np.divide(away, half[owner], out=np.zeros_like(away), where=half[owner] > 0.0)
        pull = 2.0 * (matrix @ middle) - problem.force
        cost = self._split.diagonal[owner] * self._x**2 + self._x * self._t + pull[owner] * away
        price = scale * magnitude([self._low, self._high]) / (LIMITS.enough * unit)
        pushing = self._push * self._bounds * scale[self._pushed] / unit
        spare, each = np.zeros(len(self._push) + 2 * n), np.arange(n)
        ones = np.ones(n)
        return Programme(
            matrix=problem.stiffness * half / scale[:, None],
            curvature=2.0 * (matrix * half) * half[:, None] / unit,
            force=(problem.force - problem.stiffness @ middle) / scale,
            owner=np.concatenate([owner, self._pushed, each, each]),
            factors=np.stack(
                [
                    np.concatenate([self._t / scale[owner], self._push, ones, -ones]),
                    np.concatenate([-along, spare]),
                    np.concatenate([np.ones(len(owner)), spare]),
                ]
            ),
            cost=np.concatenate([cost / unit, pushing, price, price]),
            start=np.concatenate([1.0 / np.bincount(owner, minlength=n)[owner], np.ones(len(spare))]),
        )

    def weights(self, here: Iterate) -> tuple[Array, Array]:
        """The weights and the point of an iterate, (n,) each.

        Args:
            here: the iterate.
        """
        return -here.duals[0] * self._unit / self._force_scale, self._middle + self._half * here.x


def _points(graphs: Graphs, diagonal: Array) -> tuple[Integers, Array, Array]:
    """The ends of arcs, and some points between them where h is convex: unknown, displacement, traction, (m,) each."""
    owner, k = np.nonzero(graphs.meets)
    begin, end = graphs.begin[owner, k], graphs.end[owner, k]
    inner = np.flatnonzero((diagonal[owner] + graphs.slope[owner, k] > 0.0) & (end > begin))
    quarters = (0.25, 0.5, 0.75)
    which = [np.arange(len(owner))] * 2 + [inner] * len(quarters)
    x = np.concatenate([begin, end, *(begin[inner] + share * (end - begin)[inner] for share in quarters)])
    each = np.concatenate(which)
    owner, k = owner[each], k[each]
    return owner, x, graphs.offset[owner, k] + graphs.slope[owner, k] * x


def left_of(relaxation: Relaxation, cell: Box, cut: Callable[[], bool]) -> Box | None:
    """What is left of a cell; None if no stationary point is in it.

    Args:
        relaxation: of the problem.
        cell: the cell.
        cut: whether to be content with less of a proof, asked at each step of the programme.
    """
    problem = relaxation.problem
    split = Split.of(problem, relaxation.diagonal(cell.low, cell.high))
    if not np.isfinite(split.short):
        return cell
    programme, best = BalanceProgramme(problem, split, cell.low, cell.high), None
    for step, here in enumerate(iterates(programme.programme)):
        if cut():
            break
        if step % 3 == 0 and 4 * step >= LIMITS.most_steps:
            proof = weighed(problem, split, (cell.low, cell.high), *programme.weights(here))
            if proof.total > 0.0:
                return None
            if best is not None and not proof.total > best.total + LIMITS.enough * abs(best.total):
                break
            if np.isfinite(proof.total):
                best = proof
    if best is None:
        return cell
    ends = best.smaller(cell.low, cell.high)
    return None if ends is None else Box.around(*ends, cell.x)


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
        return (self.factors * duals[:, self.owner]).sum(axis=0)


class Iterate(NamedTuple):
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


def iterates(programme: Programme) -> Iterator[Iterate]:
    """The steps of the method, until it ends or rounding stops it.

    Args:
        programme: the programme.
    """
    n, z = len(programme.force), programme.start
    here = Iterate(x=np.zeros(n), duals=np.zeros((3, n)), shares=z, reduced=np.maximum(np.abs(programme.cost), 1.0))
    for _ in range(LIMITS.most_steps):
        yield here
        rest = _rest(programme, here)
        off = max(float(here.shares @ here.reduced) / len(z), *map(magnitude, rest))
        if off < LIMITS.zero:
            return
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                step = _Newton(programme, here, rest).step()
        except LinAlgError:
            return
        if not all(np.all(np.isfinite(change)) for change in step):
            return
        way = LIMITS.nearly * min(_most(here.shares, step[2]), _most(here.reduced, step[3]))
        here = Iterate(*(part + way * change for part, change in zip(here, step, strict=True)))


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
        return np.linalg.inv(blocks + (4.0 * EPSILON * (size + 1.0))[:, None, None] * np.eye(3))

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
        return np.einsum("nij,jn->in", self._inverse, right)


def _most(values: Array, change: Array) -> float:
    """The share of a change that leaves all values positive, at most one."""
    falls = change < 0.0
    with np.errstate(over="ignore"):
        return min(1.0, float((-values[falls] / change[falls]).min())) if falls.any() else 1.0
