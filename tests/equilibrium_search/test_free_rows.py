"""Elastic parts near those of a point, where rigid motions are free: against brute force, and reasoning by hand."""

from __future__ import annotations

import condensed
import numpy as np
import pytest
from array_enumeration import stationary

from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.scalar_problem import ScalarProblem
from hvi_fenicsx.typing import Array

BOND = condensed.graph([[0.0, 0.0], [0.1, 1.0], [0.1, 0.3]])


def free_chain(seed: int) -> ScalarProblem:
    """Three points in a row that only bonds hold, the last one above a floor or not, near their peak."""
    random = np.random.default_rng(seed)
    stiffness = condensed.chain(3, random.choice([0.05, 1.0, 20.0]))
    lower, floor = np.full(3, -np.inf), random.uniform() < 0.3
    if floor:  # a point that touches, beside the row
        stiffness = np.block([[stiffness, np.zeros((3, 1))], [np.zeros((1, 3)), np.zeros((1, 1))]])
        spring = 0.3 * np.array([1.0, -1.0, 0.0, 0.0]) + np.array([0.0, 0.0, 0.0, 1.0])
        stiffness, lower = stiffness + np.outer(spring, spring), np.r_[lower, -0.05]
    force = np.zeros(len(lower))
    force[:3] = random.normal(size=3) * random.choice([0.1, 1.0])
    force[:3] += random.uniform(-0.95, 0.95) - force[:3].mean()
    return scalar_problem(condensed.problem(stiffness, force, condensed.bonds(BOND, [0, 1, 2]), lower=lower))


def all_of(problem: ScalarProblem) -> Enumeration:
    search = Enumeration(problem=problem)
    search.start()
    assert search.run(lambda: search.cells > 2000, lambda _: None)
    return search


def near(x: Array, others: list[Array]) -> bool:
    return any(np.max(np.abs(x - y)) < 1e-7 for y in others)


QUICK = [0, 1, 2, 3]
MANY = [pytest.param(seed, marks=pytest.mark.long) for seed in range(60) if seed not in QUICK]


@pytest.mark.parametrize("seed", [*QUICK, *MANY])
def test_all_points_of_a_row_that_only_bonds_hold_are_those_of_brute_force(seed: int) -> None:
    problem = free_chain(seed)
    wanted, listed = stationary(problem), [p.x for p in all_of(problem).points]
    assert all(near(x, listed) for x in wanted)
    assert all(near(x, wanted) for x in listed)
