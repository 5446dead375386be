"""Points of low energy: the branch iteration on arrays, with one convex programme a step."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from ..typing import Array
from .convex_programme import minimise, never
from .length_newton import LengthNewton
from .length_programme import LengthProgramme
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
        found = _minimiser(problem, low, high, x, cut)
        after = problem.energy(found)
        fall, size = energy - after, problem.energy_size(x)
        if not fall > limits.rounding * size:
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
    chains = rising.on(np.minimum(low, at), np.maximum(high, at))
    if not len(lengths):
        return minimise(problem.stiffness, force, chains, x, problem.thresholds.programmes, cut).x
    size, felt = at[n:], lengths.felt(lengths.vectors(x)) * lengths.factors
    along = np.divide(pull[n:], size, out=np.zeros_like(size), where=size > 0.0)[:, None] * felt
    force[lengths.members] += along[lengths.there]
    laws = [chains.rows(i) for i in range(len(at))]
    programme = LengthProgramme.of(problem, problem.stiffness, force, laws, np.zeros(len(lengths)))
    return LengthNewton(programme, cut).minimiser(x)
