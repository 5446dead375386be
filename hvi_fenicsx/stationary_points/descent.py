"""Points of low energy: the branch iteration on arrays, with one convex programme a step."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..laws.arc import Arc
from ..typing import Array
from .arcs import Chain, on_interval
from .convex_programme import Chains, minimise
from .length_newton import LengthNewton
from .length_programme import LengthProgramme
from .scalar_problem import ScalarProblem


def majorant(arcs: Chain, low: float, high: float, x: float) -> Sequence[Arc]:
    """A convex chain that is nowhere below the given one and equal to it at x: falls are linearised there.

    Args:
        arcs: a chain over the whole line.
        low: begin of the interval.
        high: end of the interval.
        x: where they are equal.
    """
    part = on_interval(arcs, low, high)
    k = next(i for i, a in enumerate(part) if x <= a.high)
    here = part[k]
    result = [Arc(here.low, here.high, x, here.at(x), here.rate(x), max(here.slope, 0.0))]
    for before, a in zip(part[k:], part[k + 1 :], strict=False):
        end, jump = result[-1], max(a.rate(a.low) - before.rate(a.low), 0.0)
        result.append(Arc(a.low, a.high, a.low, end.at(a.low), end.rate(a.low) + jump, max(a.slope, 0.0)))
    for after, a in zip(part[k:0:-1], part[k - 1 :: -1] if k else (), strict=False):
        end, jump = result[0], max(after.rate(a.high) - a.rate(a.high), 0.0)
        result.insert(0, Arc(a.low, a.high, a.high, end.at(a.high), end.rate(a.high) - jump, max(a.slope, 0.0)))
    return result


def descend(problem: ScalarProblem, low: Array, high: Array, x: Array, goal: float = math.inf) -> tuple[Array, float]:
    """A point of a box at which no convex step lowers the energy, and its energy.

    Args:
        problem: the problem.
        low: of the box, (n + m,), finite.
        high: of the box, (n + m,), finite.
        x: where to begin, (n,).
        goal: a descent that comes down too slowly to reach this energy is given up.
    """
    energy, limits = problem.energy(x), problem.thresholds.descent
    for _ in range(limits.most_steps):
        at = problem.arguments(x)
        ends = zip(low, np.maximum(high, at), at, strict=True)
        chains = [majorant(c, *e) for c, e in zip(problem.chains, ends, strict=True)]
        found = _minimiser(problem, chains, x)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > limits.rounding * size:
            break
        x, energy = found, after
        if energy - goal > limits.reach * fall or (len(problem.lengths) and fall <= limits.slow * size):
            break
    return np.asarray(x), energy


def _minimiser(problem: ScalarProblem, chains: list[Sequence[Arc]], x: Array) -> Array:
    """The minimiser of a majorant. Of a law of a length ψ, the part that would fall is linearised along the vector."""
    lengths, n = problem.lengths, problem.size
    if not len(lengths):
        return minimise(problem.stiffness, problem.force, Chains.of(chains), x, problem.thresholds.programmes).x
    slopes = np.array([max(-c[0].rate(c[0].low), 0.0) for c in chains[n:]])
    size = lengths.of(x)
    felt = lengths.felt(lengths.vectors(x)) * lengths.factors
    pull = np.divide(slopes, size, out=np.zeros_like(size), where=size > 0.0)[:, None] * felt
    force = problem.force.copy()
    force[lengths.members] += pull[lengths.there]
    risen = [[_steeper(a, slope) for a in c] for c, slope in zip(chains[n:], slopes, strict=True)]
    programme = LengthProgramme.of(problem, problem.stiffness, force, [*chains[:n], *risen], np.zeros(len(lengths)))
    return LengthNewton(programme).minimiser(x)


def _steeper(arc: Arc, slope: float) -> Arc:
    """The arc with a line through zero added."""
    return arc._replace(value=arc.value + slope * arc.anchor, traction=arc.traction + slope)
