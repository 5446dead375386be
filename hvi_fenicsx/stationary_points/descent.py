"""Points of low energy: the branch iteration on arrays, with one convex programme a step."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..typing import Array
from .convex_programme import Chains, minimise, never
from .length_newton import LengthNewton
from .length_programme import LengthProgramme
from .majorants import majorants
from .scalar_problem import ScalarProblem


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
    for _ in range(limits.most_steps):
        if cut():
            break
        at = problem.arguments(x)
        chains = majorants(problem.arcs, np.minimum(low, at), np.maximum(high, at), at)
        found = _minimiser(problem, chains, x, cut)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > limits.rounding * size:
            break
        x, energy = found, after
        if energy - goal > limits.reach * fall or (len(problem.lengths) and fall <= limits.slow * size):
            break
    return np.asarray(x), energy


def _minimiser(problem: ScalarProblem, chains: list[Array], x: Array, cut: Callable[[], bool]) -> Array:
    """The minimiser of a majorant. Of a law of a length ψ, the part that would fall is linearised along the vector."""
    lengths, n = problem.lengths, problem.size
    if not len(lengths):
        limits = problem.thresholds.programmes
        return minimise(problem.stiffness, problem.force, Chains.of(chains), x, limits, cut).x
    slopes = np.array([max(-_first_rate(c), 0.0) for c in chains[n:]])
    size = lengths.of(x)
    felt = lengths.felt(lengths.vectors(x)) * lengths.factors
    pull = np.divide(slopes, size, out=np.zeros_like(size), where=size > 0.0)[:, None] * felt
    force = problem.force.copy()
    force[lengths.members] += pull[lengths.there]
    risen = [_steeper(c, slope) for c, slope in zip(chains[n:], slopes, strict=True)]
    programme = LengthProgramme.of(problem, problem.stiffness, force, [*chains[:n], *risen], np.zeros(len(lengths)))
    return LengthNewton(programme, cut).minimiser(x)


def _first_rate(chain: Array) -> float:
    """The traction at the begin of a chain (k, 6)."""
    low, _, anchor, _, traction, slope = chain[0]
    return float(traction + slope * (low - anchor))


def _steeper(chain: Array, slope: float) -> Array:
    """A chain (k, 6) with a line through zero added."""
    low, high, anchor, value, traction, curvature = chain.T
    return np.column_stack([low, high, anchor, value + slope * anchor, traction + slope, curvature])
