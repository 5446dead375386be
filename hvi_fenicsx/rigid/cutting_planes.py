"""Minimising a positively homogeneous convex function over a polyhedral cone of rigid motions.

Kelley's cutting planes: a subgradient of a slip integral bounds it from below everywhere,
whatever the load and the strength of the law, so the cuts are kept and shared by all programmes.
Each linear programme has k unknowns plus one for each part and is solved by HiGHS; of the cone it sees only
the rows that were once violated. With scalar slips the result is exact after finitely many cuts; with vector
slips (3D) the lower bound and the value attained approach each other until HiGHS' own accuracy stops them,
some 1e-11 of the scale.

Everything here is serial and deterministic: one rank runs it and sends the result to the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from ..errors import SolverError
from ..laws import Length
from ..typing import Array, magnitude
from .motions import DEFAULT

_DIGITS = 12
"""To which directions of rows, planes and values are compared; all other errors of the programme are larger."""


@dataclass(frozen=True)
class SlipIntegral:
    """G(y) = Σ_i δ(B_i y).

    Attributes:
        rows: the B_i, each times its lumped area, (m, r, k); r = 1 to 3 components.
        length: δ.
    """

    rows: Array
    length: Length

    def value(self, y: Array) -> float:
        """The integral at y, (k,)."""
        return float(self.length.of(self.rows @ y).sum())

    def joined(self, other: SlipIntegral) -> SlipIntegral:
        """The sum of two integrals of the same length, its rows merged (:func:`merged`).

        Args:
            other: the other one.
        """
        return SlipIntegral(merged(np.concatenate([self.rows, other.rows])), self.length)

    def subgradients(self, motions: Array) -> Array:
        """One subgradient at each of some motions (s, k), (s, k): a vertex without slip contributes zero."""
        slips = np.tensordot(motions, self.rows, axes=(1, 2))
        ways = self.length.gradient(slips.reshape(-1, self.rows.shape[1])).reshape(slips.shape)
        return np.tensordot(ways, self.rows, axes=2)


def merged(rows: Array) -> Array:
    """Rows B_i that are positive multiples of one another as their sum: δ is positively homogeneous, so G stays.

    The vertices of a flat part have one row in the plane, whatever the mesh. Vanishing rows are left out.

    Args:
        rows: (m, r, k).
    """
    flat = rows.reshape(len(rows), rows.shape[1] * rows.shape[2])
    length = np.linalg.norm(flat, axis=1)
    flat, length = flat[length > 0.0], length[length > 0.0]
    directions, group = np.unique(np.round(flat / length[:, None], _DIGITS) + 0.0, axis=0, return_inverse=True)
    found = np.zeros_like(directions)
    np.add.at(found, group.ravel(), flat)
    return found.reshape(-1, *rows.shape[1:])


@dataclass(frozen=True)
class Functional:
    """The function linear·y + Σ_p factors_p G_p(y) on the cone {cone @ y <= 0}.

    Attributes:
        linear: (k,).
        factors: of the slip integrals, (p,).
        cone: rows of length one, (c, k).
    """

    linear: Array
    factors: Array
    cone: Array

    def minus(self, load: Array, factor: float = 1.0) -> Functional:
        """The functional less the work of a load.

        Args:
            load: its work on the basis motions, (k,).
            factor: what the load is multiplied by.
        """
        return replace(self, linear=self.linear - factor * load)


@dataclass(frozen=True)
class Polytope:
    """The bounded set of the y with upper @ (y, x) <= limits for some x, and equal @ y = value.

    Attributes:
        upper: (q, k + x).
        limits: (q,).
        equal: (e, k).
        value: (e,).
    """

    upper: Array
    limits: Array
    equal: Array
    value: Array


def ball(frame: Array) -> Polytope:
    """|y| <= 1 in the largest of the rigid coefficients z = frame @ y, frame (n, k)."""
    none = np.zeros((0, frame.shape[1]))
    return Polytope(np.vstack([frame, -frame]), np.ones(2 * len(frame)), none, np.zeros(0))


def idle(frame: Array, load: Array) -> Polytope:
    """The motions with |y| <= 1 on which a load does no work.

    Args:
        frame: rigid coefficients of the basis motions, (n, k).
        load: its work on the basis motions, (k,).
    """
    return replace(ball(frame), equal=load[None], value=np.zeros(1))


def cross(frame: Array) -> Polytope:
    """Σ|z_j| <= 1: its corners are pure translations and rotations, so it yields directions easy to name."""
    n, k = frame.shape
    sizes = np.vstack([np.eye(n), np.eye(n), -np.ones(n)])  # x_j >= |z_j|
    upper = np.hstack([np.vstack([frame, -frame, np.zeros(k)]), -sizes])
    return replace(ball(frame), upper=upper, limits=np.r_[np.zeros(2 * n), 1.0])


def faces(frame: Array, across: Array) -> Iterator[Polytope]:
    """The faces of the sphere |y| = 1 in the space orthogonal to some motions.

    Args:
        frame: rigid coefficients of the basis motions, (n, k).
        across: the motions to which y is to be orthogonal, (q, k).
    """
    whole = ball(frame)
    for row in whole.upper[np.abs(whole.upper).max(axis=1) > 0.0]:
        yield replace(whole, equal=np.vstack([row, across]), value=np.r_[1.0, np.zeros(len(across))])


@dataclass(frozen=True)
class Minimum:
    """A minimum and its proof.

    Attributes:
        value: an attained value.
        y: the motion that attains it, (k,).
        lower: the lower bound that proves it.
    """

    value: float
    y: Array
    lower: float


@dataclass
class CuttingPlanes:
    """The motions with rigid coefficients frame @ y, their slip integrals, and the cuts found so far.

    Attributes:
        frame: rigid coefficients of the basis motions, (n, k).
        integrals: the slip integral of each part.
        scale: the size of the works that are compared.
        cuts: subgradients (k,) of each slip integral.
    """

    frame: Array
    integrals: tuple[SlipIntegral, ...]
    scale: float
    cuts: list[Array] = field(init=False)

    def __post_init__(self) -> None:
        k = self.frame.shape[1]
        self.cuts = [np.zeros((1, k)) for _ in self.integrals]
        self._cut(np.vstack([np.eye(k), -np.eye(k)]), np.ones(len(self.integrals)))

    def evaluate(self, f: Functional, y: Array) -> float:
        """The value of f at y, all vertices summed; the cone is not looked at.

        Args:
            f: the functional.
            y: a motion (k,).
        """
        slip = sum(b * g.value(y) for b, g in zip(f.factors, self.integrals, strict=True) if b)
        return float(f.linear @ y + slip)

    def minimise(self, f: Functional, region: Polytope, give_up: float = np.inf) -> Minimum | None:
        """Minimum of a convex f over region and cone; None if that is empty or nothing in it is small enough.

        Args:
            f: the functional, with its cone.
            region: where to search.
            give_up: values above this are of no interest.

        Raises:
            SolverError: the gap between value and bound does not close.
        """
        best = Minimum(np.inf, np.zeros(self.frame.shape[1]), -np.inf)
        active, smallest = _seeds(f.cone), np.inf
        for _ in range(DEFAULT.max_rounds):
            found = self._solve(f, region, active)
            if found is None or found.lower > give_up:
                return None
            if self._violated(f.cone, found.y, active):
                continue
            value = self.evaluate(f, found.y)
            best = Minimum(value, found.y, found.lower) if value < best.value else best
            gap = best.value - found.lower
            if gap <= 10.0**-_DIGITS * self.scale or smallest <= gap <= DEFAULT.rounding * self.scale:
                return replace(best, lower=found.lower)
            smallest = min(smallest, gap)
            # where G is smooth, a cut half way to the best motion halves the rounds
            self._cut(np.array([found.y, 0.5 * (found.y + best.y)]), f.factors)
        raise SolverError(f"rigid motions: {DEFAULT.max_rounds} cutting planes left a gap of {smallest:.1e}")

    def _cut(self, motions: Array, factors: Array) -> None:
        """Add the planes at some motions (s, k) that lie above the known ones there."""
        for p in np.flatnonzero(factors > 0.0):
            for y, plane in zip(motions, self.integrals[p].subgradients(motions), strict=True):
                if plane @ y > np.max(self.cuts[p] @ y) + 10.0**-_DIGITS * np.linalg.norm(plane):
                    self.cuts[p] = np.vstack([self.cuts[p], plane])

    def _solve(self, f: Functional, region: Polytope, active: list[int]) -> Minimum | None:
        """Minimum of the cut model; `value` and `lower` are both the model's."""
        if self.frame.shape[1] == 1:
            return self._solve_line(f, region)
        c, a_ub, b_ub = self._rows(f, region, active)
        size = magnitude(c) or 1.0
        k, a_eq = len(f.linear), np.zeros((len(region.equal), len(c)))
        a_eq[:, :k] = region.equal
        bounds = [(None, None)] * k + [(0.0, None)] * (len(c) - k)
        found = linear_programme(c / size, a_ub, b_ub, a_eq, region.value, bounds)
        if found.status == 2:
            return None
        if found.status != 0:
            raise SolverError(f"HiGHS on the rigid motions: {found.message}")
        return Minimum(found.fun * size, found.x[:k], found.fun * size)

    def _rows(self, f: Functional, region: Polytope, active: list[int]) -> tuple[Array, Array, Array]:
        """Cost and inequality rows of the cut model in (y, one height for each part with factor > 0).

        Heights are in units of the part's largest cut: HiGHS' tolerances are absolute, and parts may be small.
        """
        parts = [p for p, b in enumerate(f.factors) if b > 0.0]
        sizes = [magnitude(self.cuts[p]) or 1.0 for p in parts]
        cuts = [self.cuts[p] / size for p, size in zip(parts, sizes, strict=True)]
        sides, counts = np.vstack([f.cone[active], *cuts]), [len(rows) for rows in cuts]
        k, (q, width) = len(f.linear), region.upper.shape
        left = np.zeros((q + len(sides), width + len(parts)))
        left[:q, :width], left[q:, :k] = region.upper, sides
        left[q + len(active) + np.arange(sum(counts)), np.repeat(width + np.arange(len(parts)), counts)] = -1.0
        cost = np.r_[f.linear, np.zeros(width - k), f.factors[parts] * sizes]
        return cost, left, np.r_[region.limits, np.zeros(len(sides))]

    def _solve_line(self, f: Functional, region: Polytope) -> Minimum | None:
        """One motion only: two rays and the origin, no linear programme."""
        reach = 1.0 / np.abs(self.frame).max()
        found = []
        for y in np.array([[reach], [-reach], [0.0]]):
            off = max(magnitude(region.equal @ y - region.value), (f.cone @ y).max(initial=0.0))
            if off <= DEFAULT.exact:
                value = self.evaluate(f, y)
                found.append(Minimum(value, y, value))
        return min(found, key=lambda one: one.value) if found else None

    def _violated(self, cone: Array, y: Array, active: list[int]) -> bool:
        """Whether y leaves the cone; the rows it violates most are then added to the active ones."""
        excess = cone @ y
        excess[active] = 0.0
        worst = np.flatnonzero(excess > max(0.5 * excess.max(initial=0.0), DEFAULT.exact))
        active.extend(map(int, worst))
        return len(worst) > 0


def _seeds(cone: Array) -> list[int]:
    """Rows extreme in one coefficient: on a straight part these are its ends, and no other is ever needed."""
    return sorted({*cone.argmin(axis=0).tolist(), *cone.argmax(axis=0).tolist()}) if len(cone) else []


def linear_programme(*problem: Any) -> Any:
    """What HiGHS finds, its options narrow at first, wider and by another algorithm where it is left without a verdict.

    Args:
        *problem: as for ``scipy.optimize.linprog``, up to the bounds.

    Returns:
        Its result: the status is 0 where a minimum was found, 2 where nothing is admissible.
    """
    # Imported here: it takes longer than the analysis of a scene that needs no linear programme.
    from scipy.optimize import linprog
    from scipy.sparse import csr_array

    cost, rows, *rest = problem
    names = "primal_feasibility_tolerance", "dual_feasibility_tolerance"
    tolerances = DEFAULT.exact, DEFAULT.rounding
    for method, tolerance, presolve in product(("highs-ds", "highs-ipm"), tolerances, (False, True)):
        options = {"presolve": presolve, **dict.fromkeys(names, tolerance)}
        found = linprog(cost, csr_array(rows), *rest, method=method, options=options)
        if found.status in (0, 2):
            break
    return found
