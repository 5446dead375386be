"""A systematic search without a proof: loading from several loads, and deflation from each state.

The starts are the ends of loading in steps from no load, from twice and four times the load, and from the opposite one,
and multiples of the first. From each the energy is lowered, and Newton's method looks for further points until it
finds none, then from each point that is known (:mod:`.deflation`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..typing import Array
from .arcs import ROUNDING
from .convex_programme import minimise, never
from .deflation import DeflatedNewton
from .length_programme import LengthProgramme
from .scalar_problem import ScalarProblem
from .stationarity import PointList

PROGRAMMES: list[list[float]] = [[k / 8 for k in range(1, 9)], [2, 1.5, 1], [4, 2, 1], [-1, 0, 1]]
"""Load factors, one after the other; each programme begins at rest."""
MULTIPLES = (0, 0.5, 2, 5, 20)
"""They multiply the state that the first programme leads to."""


def candidates(problem: ScalarProblem, known: PointList, stop: Callable[[], bool]) -> Iterator[Array]:
    """Points that may be stationary, one after the other.

    Args:
        problem: the problem.
        known: the points found, to which the caller adds those that are.
        stop: asked before each attempt, and inside long ones.
    """
    newton = None if len(problem.lengths) else DeflatedNewton(problem)
    for start in _starts(problem, stop):
        if stop():
            return
        if not problem.is_far(x := _descended(problem, start, stop)):
            yield x
        if newton is not None and not problem.is_far(start):
            yield from _deflated(newton, start, known, stop)
    tried = 0
    while newton is not None and tried < min(len(known), problem.thresholds.systematic.most_points):
        yield from _deflated(newton, known[tried].x, known, stop)
        tried += 1


def _deflated(newton: DeflatedNewton, start: Array, known: PointList, stop: Callable[[], bool]) -> Iterator[Array]:
    """Points from near one start, for each reach until several attempts find no new one."""
    limits = newton.problem.thresholds.systematic
    for reach in limits.reaches:
        failures = attempt = 0
        while failures < limits.failures and not stop():
            before, attempt = len(known), attempt + 1
            found = newton.root(start, [p.x for p in known], reach, attempt)
            if found is not None and not newton.problem.is_far(found):
                yield found
            failures += len(known) == before


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
    energy, slow = problem.energy(x), problem.thresholds.programmes.slow if len(problem.lengths) else ROUNDING
    for _ in range(problem.thresholds.programmes.most_steps):
        if cut():
            break
        found = _minimiser(problem, low, high, x, cut)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > ROUNDING * size:
            break
        x, energy = found, after
        if energy - goal > problem.thresholds.programmes.reach * fall or fall <= slow * size:
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
        return minimise(problem.stiffness, force, chains, x, problem.thresholds.programmes, cut).x
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
