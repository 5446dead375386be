"""The search without a proof: it finds what brute force finds on small floors, and says what it leaves open."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from test_stationary_points import FAST, Case, found, oracle, problem_of

from hvi_fenicsx.equilibrium_search import stationarity, systematic
from hvi_fenicsx.equilibrium_search.deflation import DeflatedNewton, Graphs
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.found import Wanted
from hvi_fenicsx.equilibrium_search.search import find
from hvi_fenicsx.equilibrium_search.systematic import candidates


def never() -> bool:
    return False


@pytest.mark.parametrize("case", FAST, ids=str)
def test_it_finds_all_points_of_small_floors(case: Case) -> None:
    """Their number and energies are those of the independent enumeration."""
    problem, unit = problem_of(case)
    search = Enumeration(problem=problem)
    for x in candidates(problem, search.points.listed, never, never):
        search.enter(x)
    wanted = oracle(case).stationary()
    energies = sorted(p.energy * unit for p in search.points)
    np.testing.assert_allclose(energies, [p.energy for p in wanted], rtol=1e-9)


@pytest.mark.parametrize("case", FAST, ids=str)
def test_points_are_on_the_graphs_and_roots_of_the_equations_there(case: Case) -> None:
    problem, _ = problem_of(case)
    graphs, stiffness = Graphs.of(problem), np.diag(problem.stiffness)
    for point in found(problem).points:
        force = problem.force - problem.stiffness @ point.x
        x, t, dx, dt = graphs.at(graphs.nearest(point.x, force))
        np.testing.assert_allclose(x, point.x, atol=1e-12 * np.max(np.abs(point.x)))
        np.testing.assert_allclose(t, force, atol=1e-9 * np.max(np.abs(problem.force)))
        np.testing.assert_allclose(stiffness * np.abs(dx) + np.abs(dt), 1.0, rtol=1e-12)


def test_graphs_of_a_body_that_moves_freely_are_followed_too() -> None:
    """Along a free motion S is zero: a flat piece of a law has a length all the same."""
    problem, _ = problem_of(FAST[0])
    graphs = Graphs.of(dataclasses.replace(problem, stiffness=np.zeros_like(problem.stiffness)))
    _, _, dx, dt = graphs.at(graphs.nearest(np.linspace(0.0, 1.0, problem.size), np.zeros(problem.size)))
    np.testing.assert_allclose(graphs.weight * np.abs(dx) + np.abs(dt), 1.0, rtol=1e-12)


def test_newton_keeps_away_from_what_is_known() -> None:
    problem, _ = problem_of(FAST[0])
    newton, points = DeflatedNewton(problem), found(problem).points
    for point in points:
        others = [p.x for p in points if p is not point]
        roots = [newton.root(x, others, 0.1, k) for x, k in itertools.product(others, range(20))]
        reached = [x for x in roots if x is not None]
        assert all(stationarity.imbalance(problem, x) < 1e-9 for x in reached)
        assert any(np.max(np.abs(x - point.x)) < 1e-9 for x in reached)


def test_a_search_that_is_stopped_has_what_was_found_without_proof_and_a_gap() -> None:
    """It stops when the first cells are looked at, the lowest energy is bounded and a first point is looked for."""
    problem, unit = problem_of(FAST[0])
    few = dataclasses.replace(problem.thresholds, lowest=dataclasses.replace(problem.thresholds.lowest, most_boxes=1))
    problem = dataclasses.replace(problem, thresholds=few)
    least = oracle(FAST[0]).stationary()[0].energy / unit
    with pytest.MonkeyPatch.context() as patched:
        begun: list[int] = []
        patched.setattr(systematic, "candidates", lambda *_: begun.append(1) or iter(()))
        one = find(problem, Wanted(), lambda: bool(begun), lambda _: None)
    assert (one.proven, one.complete) == (False, False)
    assert one.left
    assert one.lower_bound is not None
    assert one.lower_bound <= least * (1.0 - 1e-12 * np.sign(least))
    assert one.gap == pytest.approx((one.points[0].energy - one.lower_bound) / abs(one.points[0].energy))
