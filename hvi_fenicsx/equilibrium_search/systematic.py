"""A systematic search without a proof: loading from several loads, pieces of the laws, and deflation from each.

The starts are the ends of loading in steps from no load, from twice and four times the load, and from the opposite one;
every unknown on the same piece of its law; and fronts: the pieces beyond for the unknowns that moved most. From each
start the energy is lowered, and Newton's method looks for further points until it finds none, then from each point
that is known (:mod:`.deflation`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from ..typing import Array
from .arcs import ROUNDING
from .convex_programme import minimise, never
from .deflation import DeflatedNewton
from .length_programme import LengthProgramme
from .scalar_problem import ScalarProblem
from .stationarity import StationaryPoint, kind_of

Exact = Callable[[Array], StationaryPoint | None]
"""The stationary point near a given one, (n,); None where there is none."""


def candidates(
    problem: ScalarProblem, known: Sequence[StationaryPoint], stop: Callable[[], bool], cut: Callable[[], bool]
) -> Iterator[Array]:
    """Points that may be stationary, one after the other.

    Args:
        problem: the problem.
        known: the points found, to which the caller adds those that are.
        stop: asked before each attempt.
        cut: whether an attempt is to be cut short.
    """
    newton = None if len(problem.lengths) else DeflatedNewton(problem)
    for start in _starts(problem, cut):
        if stop():
            return
        x = _descended(problem, start, cut)
        if cut():
            return
        yield x
        if newton is not None:
            yield from _deflated(newton, start, known, stop)
    tried = 0
    while newton is not None and tried < len(known) < problem.thresholds.systematic.most_points:
        yield from _deflated(newton, known[tried].x, known, stop)
        tried += 1


def _deflated(
    newton: DeflatedNewton, start: Array, known: Sequence[StationaryPoint], stop: Callable[[], bool]
) -> Iterator[Array]:
    """Points from near one start, for each reach until several attempts find no new one."""
    limits = newton.problem.thresholds.systematic
    for reach in limits.reaches:
        failures = attempt = 0
        while failures < limits.failures and not stop():
            before, attempt = len(known), attempt + 1
            found = newton.root(start, [p.x for p in known], reach, attempt)
            if found is not None and not _far(newton.problem, found):
                yield found
            failures += len(known) == before


def near_stationary(
    problem: ScalarProblem, known: Sequence[Array], stop: Callable[[], bool], exact: Exact | None = None
) -> list[StationaryPoint]:
    """Points, by energy, where laws act on lengths, or are curved and do not bound their slopes.

    Args:
        problem: the problem.
        known: points of low energy, each (n,).
        stop: asked before each attempt, and inside long ones.
        exact: makes points near stationary ones exact, such as those of polylines near curved laws; None: they are
            taken as they are.
    """
    points, near, same = list[StationaryPoint](), list[Array](), problem.thresholds.systematic.same
    for x in itertools.chain(known, candidates(problem, points, stop, stop)):
        if _far(problem, x) or any(_same(y, x, same) for y in near):
            continue
        near.append(x)
        point = _as_it_is(problem, x) if exact is None else exact(x)
        if point is not None and not any(_same(p.x, point.x, same) for p in points):
            points.append(point)
    return sorted(points, key=lambda p: p.energy)


def _as_it_is(problem: ScalarProblem, x: Array) -> StationaryPoint:
    return StationaryPoint(x=x, energy=problem.energy(x) + problem.error, kind=kind_of(problem, x), isolated=True)


def _same(one: Array, other: Array, same: float) -> bool:
    return bool(np.max(np.abs(one - other)) < same * (1.0 + np.max(np.abs(other), initial=0.0)))


def _starts(problem: ScalarProblem, cut: Callable[[], bool]) -> Iterator[Array]:
    limits = problem.thresholds.systematic
    first = _loaded(problem, limits.programmes[0], cut)
    yield first
    yield from (_loaded(problem, programme, cut) for programme in limits.programmes[1:])
    yield from (factor * first for factor in limits.multiples)
    yield from _on_pieces(problem, first)


def _loaded(problem: ScalarProblem, programme: Sequence[float], cut: Callable[[], bool]) -> Array:
    """The state that a programme of loads leads to from rest."""
    x = np.clip(np.zeros(problem.size), problem.lower, problem.upper)
    for factor in programme:
        x = _descended(problem.under(factor * problem.force), x, cut)
    return x


def _on_pieces(problem: ScalarProblem, loaded: Array) -> Iterator[Array]:
    """The balance of forces with laws of one component on one piece each, those that moved most beyond."""
    n, arcs, limits = problem.size, problem.arcs, problem.thresholds.systematic
    here, last = arcs.at(problem.arguments(loaded))[:n], np.array([len(c) - 1 for c in problem.chains[:n]])
    order = np.argsort(-np.abs(loaded) * (last > 0), kind="stable")
    moved = int(np.count_nonzero(last))
    most = int(last.max(initial=0))
    shifts = np.linspace(-most, most, min(2 * most, limits.most_shifts) + 1)
    for beyond in sorted({round(shift) for shift in shifts} - {0}):
        for count in sorted({round(moved * share) for share in np.linspace(0.0, 1.0, limits.fronts + 1)} - {0}):
            pieces = here.copy()
            pieces[order[:count]] += beyond
            start = _balanced(problem, np.clip(pieces, 0, last))
            if start is not None:
                yield start


def _balanced(problem: ScalarProblem, pieces: Array) -> Array | None:
    """Where forces are in balance if each law was the parabola of one piece; None where nothing holds the body."""
    rows, arcs = np.arange(problem.size), problem.arcs
    slopes = np.maximum(arcs.slopes[rows, pieces], 0.0)
    offset = arcs.tractions[rows, pieces] - slopes * arcs.anchors[rows, pieces]
    try:
        x = np.linalg.solve(problem.stiffness + np.diag(slopes), problem.force - offset)
    except np.linalg.LinAlgError:
        return None
    return np.clip(x, np.maximum(problem.lower, -problem.far), np.minimum(problem.upper, problem.far))


def _descended(problem: ScalarProblem, x: Array, cut: Callable[[], bool]) -> Array:
    far = problem.far
    low, high = problem.with_lengths(np.maximum(problem.lower, -far), np.minimum(problem.upper, far))
    n = problem.size
    return descend(problem, low, high, np.clip(x, low[:n], high[:n]), cut=cut)[0]


def _far(problem: ScalarProblem, x: Array) -> bool:
    """Whether it is at the end of what is searched, or beyond: a body comes off."""
    return bool(np.max(np.abs(x), initial=0.0) >= problem.far)


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
    energy, limits = problem.energy(x), problem.thresholds.descent
    for _ in range(problem.thresholds.programmes.most_steps):
        if cut():
            break
        found = _minimiser(problem, low, high, x, cut)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > ROUNDING * size:
            break
        x, energy = found, after
        if energy - goal > limits.reach * fall or (len(problem.lengths) and fall <= limits.slow * size):
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
