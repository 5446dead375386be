"""All equilibria of curved laws, proven: against scans of two unknowns, random starts, and polylines for ε → 0."""

from __future__ import annotations

import condensed
import numpy as np
import pytest

from hvi_fenicsx import laws
from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.stationary_points.all_points import Enumeration
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.curved_laws import CurvedLaws
from hvi_fenicsx.system.condensed_problem import CondensedProblem
from hvi_fenicsx.typing import Array

MODEL = laws.QuadraticLinear(2.0, 1.0, 1.0)
LAWS = {
    "chks": registered()["chks"]().relative(MODEL, 0.05),
    "narrow chks": registered()["chks"]().relative(MODEL, 0.002),
    "teeth": registered()["log_exp"]().relative(laws.Sawtooth(3.0, 1.0, 0.5, 3), 0.02),
    "paper": registered()["paper"]().relative(MODEL, 0.1),
    "exponential": laws.Exponential(2.0, 0.5, 1.0),
    "smoothed exponential": registered()["chks"]().relative(laws.Exponential(2.0, 0.5, 1.0), 0.01),
}
FAR = 2000.0
MOST_PUSH = 20.0
"""Forces that a bound bears are not larger."""


def enumerated(problem: CondensedProblem) -> Enumeration:
    near = scalar_problem(problem, tractions=True)
    search = Enumeration(problem=near, laws=CurvedLaws(near=near, problem=problem) if near.error else None)
    search.start()
    assert search.run(lambda: search.cells > 5000, lambda _: None)
    assert not search.undecided
    return search


def graph(law: laws.Superpotential, lower: float) -> tuple[Array, Array]:
    """Points along the graph of a law and a lower bound, jumps included, which rise: displacements and tractions."""
    tail = np.geomspace(6.0, FAR, 20_000)
    x = np.unique(np.concatenate([np.linspace(-6.0, 6.0, 200_001), tail, -tail, law.kinks, [max(lower, -FAR)]]))
    x = x[x >= lower]
    left, right = law.left(x), law.right(x)
    left[x == lower] = right[x == lower] - MOST_PUSH
    places, tractions = [x], [right]
    for at in np.flatnonzero(right > left):
        tractions.append(np.linspace(left[at], right[at], 100_000, endpoint=False))
        places.append(np.full(tractions[-1].size, x[at]))
    order = np.lexsort((np.concatenate(tractions), np.concatenate(places)))
    return np.concatenate(places)[order], np.concatenate(tractions)[order]


def scanned(problem: CondensedProblem) -> int:
    """How often the second's balance changes its sign along the graph of the first, whose balance gives the second."""
    (s, f), (first, second) = (problem.stiffness, problem.load(1.0)), problem.bonds
    x, t = graph(first.law, problem.lower[0])
    y = (f[0] - t - s[0, 0] * x) / s[0, 1]
    rest = s[0, 1] * x + s[1, 1] * y + second.law.right(y) - f[1]
    rest = np.where(y < problem.lower[1], -np.inf, rest)
    return int(np.count_nonzero(np.diff(np.sign(rest))))


def two_bonds(law: laws.Superpotential, share: float, lower: float = -np.inf) -> CondensedProblem:
    """Two bonds, each of which carries a load, with a spring between them, and another spring to the ground."""
    pull = share * float(law.right(np.linspace(0.0, 5.0, 5001)).max()) * np.array([1.05, 0.95])
    stiffness = 0.8 * np.array([[1.0, -1.0], [-1.0, 1.0]]) + 0.1 * np.eye(2)
    first, second = (condensed.bonds(law, [i]) for i in (0, 1))
    return condensed.problem(stiffness, pull, first, second, lower=lower)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9, 1.02])
def test_all_points_of_two_bonds_are_those_of_a_scan(law: laws.Superpotential, share: float) -> None:
    problem = two_bonds(law, share)
    assert len(enumerated(problem).points) == scanned(problem)


def random_pair(seed: int, pair: tuple[laws.Superpotential, laws.Superpotential]) -> CondensedProblem:
    """Two laws on any stiffness, with any load, and half of the time with a bound."""
    random = np.random.default_rng(seed)
    factor = random.normal(size=(2, 2))
    stiffness = 0.3 * factor @ factor.T + 0.02 * np.eye(2)
    lower = np.where(random.uniform(size=2) < 0.5, -np.inf, random.uniform(-0.3, 0.6, 2))
    bonds = [condensed.bonds(law, [i], signs=random.choice([-1.0, 1.0])) for i, law in enumerate(pair)]
    return condensed.problem(stiffness, random.uniform(-1.0, 3.0, 2), *bonds, lower=lower)


@pytest.mark.parametrize("seed", range(24))
def test_all_points_of_two_laws_with_bounds_are_those_of_a_scan(seed: int) -> None:
    every = list(LAWS.values())
    problem = random_pair(seed, (every[seed % 6], every[(seed // 2) % 6]))
    assert len(enumerated(problem).points) == scanned(problem)
