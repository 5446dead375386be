"""Stationary points of small problems with laws of lengths: each choice of pieces, from many starts each.

For each choice, what is left are smooth equations: Sx + κz = f for the unknowns that are free, with κ a function of
|z| on an arc, an unknown of its own on a drop, and nothing for a vector that is held at zero. scipy solves them from
random starts. What it finds is kept if it is on the pieces that were chosen, and forces have the signs they need.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import root

from hvi_fenicsx.laws.arc import Arc
from hvi_fenicsx.stationary_points.scalar_problem import ScalarProblem

Array = npt.NDArray[np.float64]
NEAR = 1e-9


@dataclass(frozen=True)
class Piece:
    """An arc of a law, or one place with tractions from least to most; with the sign of the opening."""

    arc: Arc | None
    at: float = 0.0
    least: float = 0.0
    most: float = 0.0
    shut: bool = False


def pieces(problem: ScalarProblem, v: int) -> list[Piece]:
    """The pieces of the law of a vector."""
    law = [a for a in problem.chains[problem.size + v] if a.high > 0.0]
    places = [Piece(None, 0.0, 0.0, law[0].rate(0.0))] if law[0].rate(0.0) > 0.0 else []
    for a, b in itertools.pairwise(law):
        least, most = sorted((a.rate(a.high), b.rate(b.low)))
        if most - least > NEAR:
            places.append(Piece(None, a.high, least, most))
    every = [*(Piece(a) for a in law), *places]
    shut = [Piece(p.arc, p.at, p.least, p.most, True) for p in every] if problem.lengths.opens[v] else []
    return [*every, *shut]


def stationary(problem: ScalarProblem, starts: int, seed: int = 0) -> list[Array]:
    """All stationary points that are found."""
    random, found = np.random.default_rng(seed), list[Array]()
    bounds = [
        [0, *([-1] if np.isfinite(a) else []), *([1] if np.isfinite(b) else [])]
        for a, b in zip(problem.lower, problem.upper, strict=True)
    ]
    laws = [pieces(problem, v) for v in range(len(problem.lengths))]
    for sides in itertools.product(*bounds):
        for chosen in itertools.product(*laws):
            for x in _solutions(problem, sides, chosen, random, starts):
                if all(np.max(np.abs(x - y)) > 1e-6 * (1.0 + np.max(np.abs(x))) for y in found):
                    found.append(x)
    return found


def _solutions(
    problem: ScalarProblem, sides: Sequence[int], chosen: Sequence[Piece], random: np.random.Generator, starts: int
) -> Iterator[Array]:
    lengths = problem.lengths
    fixed = np.where(np.array(sides) < 0, problem.lower, np.where(np.array(sides) > 0, problem.upper, np.nan))
    for v, piece in enumerate(chosen):
        if piece.arc is None and piece.at == 0.0:
            for c in range(3):
                i = lengths.unknowns[v, c]
                if lengths.there[v, c] and not (piece.shut and c == 0):
                    if not np.isnan(fixed[i]) and fixed[i] != 0.0:
                        return
                    fixed[i] = 0.0
    free = np.flatnonzero(np.isnan(fixed))
    drops = [v for v, p in enumerate(chosen) if p.arc is None and p.at > 0.0]

    def whole(u: Array) -> Array:
        x = np.nan_to_num(fixed)
        x[free] = u[: len(free)]
        return x

    def balance(x: Array, kappa: dict[int, float]) -> tuple[Array, Array]:
        rest, sizes = problem.stiffness @ x - problem.force, np.zeros(len(chosen))
        for v, p in enumerate(chosen):
            z = lengths.factors[v] * x[lengths.unknowns[v]]
            z[0] = 0.0 if p.shut else z[0]
            sizes[v] = np.linalg.norm(z)
            k = kappa.get(v, 0.0)
            if p.arc is not None:
                k = p.arc.rate(sizes[v]) / sizes[v] if sizes[v] > 1e-12 else 0.0
            for c in range(3):
                rest[lengths.unknowns[v, c]] += lengths.factors[v, c] * k * z[c]
        return rest, sizes

    def equations(u: Array) -> Array:
        x = whole(u)
        rest, sizes = balance(x, dict(zip(drops, u[len(free) :], strict=True)))
        return np.concatenate([rest[free], [0.5 * (sizes[v] ** 2 - chosen[v].at ** 2) for v in drops]])

    seen = list[Array]()
    for _ in range(starts if len(free) else 1):
        size = 10.0 ** random.uniform(-1, 0.7)
        begin = np.concatenate([size * random.normal(size=len(free)), random.uniform(0, 2, len(drops))])
        if not begin.size:
            u = begin
        else:
            solved = root(equations, begin, tol=1e-13)
            u = solved.x
            if np.max(np.abs(equations(u))) > 1e-9:
                continue
        if any(np.max(np.abs(u - w), initial=0.0) < 1e-7 for w in seen):
            continue
        seen.append(u)
        x = whole(u)
        rest, sizes = balance(x, dict(zip(drops, u[len(free) :], strict=True)))
        if _holds(problem, sides, chosen, x, rest, sizes, dict(zip(drops, u[len(free) :], strict=True))):
            yield x


def _holds(
    problem: ScalarProblem,
    sides: Sequence[int],
    chosen: Sequence[Piece],
    x: Array,
    rest: Array,
    sizes: Array,
    kappa: dict[int, float],
) -> bool:
    """Whether a solution is on its pieces, and forces on what is held have their signs: 0 in rest + what holds."""
    lengths = problem.lengths
    if np.any(x < problem.lower - NEAR) or np.any(x > problem.upper + NEAR):
        return False
    push = -rest.copy()  # what holds must bear
    for v, p in enumerate(chosen):
        o = lengths.factors[v, 0] * x[lengths.unknowns[v, 0]]
        if lengths.opens[v] and (o > NEAR if p.shut else o < -NEAR):
            return False
        if p.arc is not None and not p.arc.low - NEAR <= sizes[v] <= p.arc.high + NEAR:
            return False
        if v in kappa and not p.least - NEAR <= kappa[v] * p.at <= p.most + NEAR:
            return False
        if p.arc is None and p.at == 0.0:
            ball = list[float]()
            for c in range(3):
                i = lengths.unknowns[v, c]
                if not lengths.there[v, c] or (p.shut and c == 0):
                    continue
                force = push[i] / lengths.factors[v, c]
                away = push[i] * sides[i] >= 0.0 and sides[i] != 0
                if away:  # the bound bears it all
                    push[i] = 0.0
                    continue
                if c == 0 and lengths.opens[v] and force < -NEAR:
                    return False
                ball.append(force)
                push[i] = 0.0
            if np.linalg.norm(ball) > p.most + NEAR:
                return False
    return all(p * s >= -NEAR for p, s in zip(push, sides, strict=True) if s != 0)
