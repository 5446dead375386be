"""Descent of the energy by convex steps, and the states that several loads lead to in this way."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..typing import Array
from .convex_programme import minimise, never
from .length_programme import LengthProgramme
from .scalar_problem import ScalarProblem
from .thresholds import LIMITS

PROGRAMMES: list[list[float]] = [[k / 8 for k in range(1, 9)], [2, 1.5, 1], [4, 2, 1], [-1, 0, 1]]
"""Load factors, one after the other; each programme begins at rest."""
MULTIPLES = (0, 0.5, 2, 5, 20)
"""They multiply the state that the first programme leads to."""


def loaded_states(problem: ScalarProblem, stop: Callable[[], bool]) -> Iterator[Array]:
    """States that no convex step makes lower: at the end of programmes of loads, and below multiples of the first.

    Args:
        problem: the problem.
        stop: asked before each, and inside long descents.
    """
    for start in _starts(problem, stop):
        if stop():
            return
        if not problem.is_far(x := _descended(problem, start, stop)):
            yield x


def _starts(problem: ScalarProblem, stop: Callable[[], bool]) -> Iterator[Array]:
    first = _loaded(problem, PROGRAMMES[0], stop)
    yield first
    yield from (_loaded(problem, programme, stop) for programme in PROGRAMMES[1:])
    yield from (factor * first for factor in MULTIPLES)


def _loaded(problem: ScalarProblem, programme: Sequence[float], stop: Callable[[], bool]) -> Array:
    """The state that a programme of loads leads to from rest."""
    x: Array = np.zeros(problem.size)
    for factor in programme:
        x = _descended(problem.under(factor * problem.force), x, stop)
    return x


def _descended(problem: ScalarProblem, x: Array, stop: Callable[[], bool]) -> Array:
    far, n = problem.far, problem.size
    low, high = problem.with_lengths(np.maximum(problem.lower, -far), np.minimum(problem.upper, far))
    return descend(problem, low, high, np.clip(x, low[:n], high[:n]), cut=stop)[0]


def descend(
    problem: ScalarProblem,
    low: Array,
    high: Array,
    x: Array,
    goal: float = math.inf,
    cut: Callable[[], bool] = never,
) -> tuple[Array, float]:
    """A point of a box at which no convex step lowers the energy, and its energy.

    Args:
        problem: the problem.
        low: of the box, (n + m,), finite.
        high: of the box, (n + m,), finite.
        x: where to begin, (n,).
        goal: a descent that comes down too slowly to reach this energy is given up.
        cut: whether to end where it is, since the search stops.
    """
    energy = problem.energy(x)
    for _ in range(LIMITS.most_steps):
        if cut():
            break
        found = _minimiser(problem, low, high, x, cut)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > LIMITS.rounding * size:
            break
        x, energy = found, after
        if energy - goal > LIMITS.most_steps * fall:
            break
    return np.asarray(x), energy


def _minimiser(problem: ScalarProblem, low: Array, high: Array, x: Array, cut: Callable[[], bool]) -> Array:
    """The minimiser of a majorant: with φ = h - g and both convex, g is replaced by its tangent at x."""
    lengths, n, at = problem.lengths, problem.size, problem.arguments(x)
    rising = problem.arcs.convex_part
    pull = rising.rates(at)[1] - problem.arcs.rates(at)[1]
    force = problem.force + pull[:n]
    begin = np.concatenate([np.minimum(low, at)[:n], np.zeros(len(lengths))])
    chains = rising.on(begin, np.maximum(high, at))
    if not len(lengths):
        return minimise(problem.stiffness, force, chains, x, cut=cut).x
    size, felt = at[n:], lengths.felt(lengths.vectors(x)) * lengths.factors
    along = np.divide(pull[n:], size, out=np.zeros_like(size), where=size > 0.0)[:, None] * felt
    force[lengths.members] += along[lengths.there]
    ends = [np.concatenate([end[:n], radial]) for end, radial in ((low, np.zeros_like(size)), (high, chains.last[n:]))]
    programme = LengthProgramme(
        problem=problem,
        a=problem.stiffness,
        b=force,
        laws=chains,
        shut=np.zeros_like(size),
        low=ends[0],
        high=ends[1],
        cut=cut,
    )
    return programme.minimiser(x)
