"""The search without a proof: it finds what brute force finds on small floors, and says what it leaves open."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from test_stationary_points import FAST, Case, oracle, problem_of

from hvi_fenicsx.equilibrium_search import systematic
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.found import Task
from hvi_fenicsx.equilibrium_search.search import find
from hvi_fenicsx.equilibrium_search.systematic import candidates


def never() -> bool:
    return False


@pytest.mark.parametrize("case", FAST, ids=str)
def test_it_finds_all_points_of_small_floors(case: Case) -> None:
    """Their number and energies are those of the independent enumeration."""
    problem, unit = problem_of(case)
    search = Enumeration(problem=problem)
    for x in candidates(problem, search.points, never):
        search.enter(x)
    wanted = oracle(case).stationary()
    energies = sorted(p.energy * unit for p in search.points)
    np.testing.assert_allclose(energies, [p.energy for p in wanted], rtol=1e-9)


def test_a_search_that_is_stopped_has_what_was_found_without_proof_and_a_gap() -> None:
    """It stops when the first cells are looked at, the lowest energy is bounded and a first point is looked for."""
    problem, unit = problem_of(FAST[0])
    limits = dataclasses.replace(problem.thresholds.systematic, first_boxes=1)
    few = dataclasses.replace(problem.thresholds, systematic=limits)
    problem = dataclasses.replace(problem, thresholds=few)
    least = oracle(FAST[0]).stationary()[0].energy / unit
    with pytest.MonkeyPatch.context() as patched:
        begun: list[int] = []
        patched.setattr(systematic, "candidates", lambda *_: begun.append(1) or iter(()))
        one = find(Task(problem=problem, stop=lambda: bool(begun)))
    assert (one.proven, one.complete) == (False, False)
    assert one.left
    assert one.lower_bound is not None
    assert one.lower_bound <= least * (1.0 - 1e-12 * np.sign(least))
    assert one.gap == pytest.approx((one.points[0].energy - one.lower_bound) / abs(one.points[0].energy))
