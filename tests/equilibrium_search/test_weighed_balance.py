"""The weighed balance of forces: against sampled points of cells, known stationary points, and its own dual."""

from __future__ import annotations

import itertools
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from enumeration import Floor, polyline
from scenes import DELTA, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.equilibrium_search.arcs import FREE, chain
from hvi_fenicsx.equilibrium_search.balance_programme import BalanceProgramme, BalanceTest
from hvi_fenicsx.equilibrium_search.boxes import fresh_box
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.relaxation import Relaxation
from hvi_fenicsx.equilibrium_search.scalar_problem import ScalarProblem
from hvi_fenicsx.equilibrium_search.weighed_balance import Graphs, Split, allowed, weighed
from hvi_fenicsx.laws.traction_graph import TractionGraph
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.typing import Array

SAWTOOTH = TractionGraph.from_points([(0.0, 0.0), (0.4, 2.0), (0.4, 0.5), (1.5, 1.8), (1.5, 0.3)])
PAPER = [(0.0, 0.0), (DELTA, 3e6), (DELTA, 1.5e6)]


def chained(random: np.random.Generator, **more: object) -> ScalarProblem:
    """Four unknowns: two bonds with teeth, one obstacle with a bond, and one obstacle alone."""
    factor = random.normal(size=(4, 3))
    teeth = chain(SAWTOOTH, 1.0, 1.0)
    given = {
        "stiffness": factor @ factor.T,
        "force": random.normal(size=4),
        "lower": np.array([-np.inf, -np.inf, 0.0, -0.3]),
        "upper": np.array([np.inf, np.inf, np.inf, 0.8]),
        "chains": (teeth, teeth, teeth, FREE),
    }
    return ScalarProblem(**(given | more))


def some_point(problem: ScalarProblem, ends: tuple[Array, Array], random: np.random.Generator) -> tuple[Array, Array]:
    """A point of a cell, and tractions that laws and bounds can bear there."""
    low, high = ends
    share = random.choice([0.0, 0.3, 0.7, 1.0], size=4) + random.uniform(0.0, 1e-3, size=4)
    x = low + np.clip(share, 0.0, 1.0) * (high - low)
    t = problem.arcs.rates(np.clip(x, low + 1e-9, high - 1e-9))[0]
    push = random.exponential(size=4)
    t = np.where(x == problem.lower, t - push, np.where(x == problem.upper, t + push, t))
    return x, t


@pytest.mark.parametrize("seed", range(4))
def test_the_proof_is_below_the_weighed_balance_of_all_points_of_a_cell(seed: int) -> None:
    random = np.random.default_rng(seed)
    problem = chained(random)
    for _ in range(30):
        low = np.maximum(random.uniform(-2.0, 1.0, size=4), problem.lower)
        ends = low, np.minimum(low + random.exponential(size=4), problem.upper)
        split = Split.of(problem, random.uniform(-0.5, 0.5, size=4))
        y, point = 2.0 * random.normal(size=(2, 4))
        proof, weights = weighed(problem, split, ends, y, point), allowed(problem, *ends, y)
        for _ in range(30):
            x, t = some_point(problem, ends, random)
            assert (x + weights) @ (problem.stiffness @ x + t - problem.force) >= proof.total - 1e-7


def test_a_diagonal_beyond_the_stiffness_is_not_used() -> None:
    problem = chained(np.random.default_rng(1))
    split = Split.of(problem, np.array([1e3, -1.0, 1e3, 0.0]))
    assert list(split.diagonal) == [0.0, -1.0, 0.0, 0.0]
    assert np.linalg.eigvalsh(split.matrix)[0] > -split.short
    assert 0.0 < split.short < 1e-12


def condensed_floor(cells: int, press: float = 6e6) -> ScalarProblem:
    law = {"law": "graph", "points": [list(point) for point in PAPER]}
    return scalar_problem(Condensation(prepare(read_tables(model(cells, press, 1e6, law))).system).problem)


def searched(problem: ScalarProblem, cut: Callable[[], bool] = lambda: False) -> Enumeration:
    search = Enumeration(problem=problem, cut=cut)
    search.start()
    assert search.run(lambda: False, lambda _: None)
    return search


@pytest.mark.parametrize("seed", range(3))
def test_weights_of_any_kind_keep_all_stationary_points(seed: int) -> None:
    problem, random = condensed_floor(3), np.random.default_rng(seed)
    points = searched(problem).points
    assert len(points) == len(Floor(3, 6e6, 1e6, polyline(PAPER)).stationary())
    for point in points:
        ends = (
            np.maximum(point.x - random.exponential(size=problem.size), problem.lower),
            np.minimum(point.x + random.exponential(size=problem.size), problem.upper),
        )
        split = Split.of(problem, random.uniform(-0.1, 0.1, size=problem.size))
        for near in (0.0, 1e-3, 1.0):
            y, p = near * random.normal(size=(2, problem.size)) + np.stack([-point.x, point.x])
            proof = weighed(problem, split, ends, y, p)
            assert not proof.excludes
            smaller = proof.smaller(*ends)
            assert smaller is not None
            assert np.all((smaller[0] <= point.x) & (point.x <= smaller[1]))


def test_the_weights_of_the_programme_prove_more_than_the_relaxation_and_random_ones() -> None:
    problem, random = condensed_floor(6), np.random.default_rng(1)
    box = fresh_box(np.maximum(problem.lower, -2.0), np.minimum(problem.upper, 2.0), np.zeros(problem.size))
    ends, relaxation = (box.low, box.high), Relaxation(problem)
    split = Split.of(problem, relaxation.curvature(box, 0.9))
    programme = BalanceProgramme(problem, split, *ends)
    best = max(weighed(problem, split, ends, *programme.weights(here)).total for here in programme.iterates())
    assert best < 0.0  # the cell has three points
    x = relaxation.solve(box, 0.9)[0].x
    for size in (0.0, *np.geomspace(1e-3, 1.0, 100)):
        y, point = np.stack([-x, x]) + size * random.normal(size=(2, problem.size))
        assert weighed(problem, split, ends, y, point).total < 2.0 * best


def test_a_cell_behind_the_drops_has_no_point() -> None:
    problem = condensed_floor(6)
    low = np.maximum(problem.lower, -20.0)
    cell = fresh_box(low, np.maximum(np.full(problem.size, -5.0), low + 1.0), np.zeros(problem.size))
    assert BalanceTest(Relaxation(problem)).look(cell) is None


def test_a_test_that_is_cut_short_excludes_less_and_loses_no_point() -> None:
    """As where a signal ends the search: what is left of each cell is kept."""
    problem = condensed_floor(4)
    low = np.maximum(problem.lower, -20.0)
    cell = fresh_box(low, np.maximum(np.full(problem.size, -5.0), low + 1.0), np.zeros(problem.size))
    assert BalanceTest(Relaxation(problem)).look(cell, lambda: True) is not None
    whole, turn = searched(problem), itertools.cycle([False] * 7 + [True])
    hurried = searched(problem, lambda: next(turn))
    assert sorted(p.energy for p in hurried.points) == pytest.approx(sorted(p.energy for p in whole.points))
    assert hurried.cells > whole.cells


def test_a_joint_alone_has_all_tractions_of_its_arcs() -> None:
    problem = chained(np.random.default_rng(2))
    at = np.full(4, 0.4)
    graphs = Graphs.of(problem, at, at)
    t = (graphs.offset + graphs.slope * 0.4)[0][graphs.meets[0]]
    assert sorted(t) == pytest.approx([0.5, 2.0])


def test_all_points_of_a_long_floor_take_few_cells() -> None:
    """The search took 55 cells before the balance was weighed."""
    table = tomllib.loads((Path(__file__).parents[2] / "demos" / "strong_law.toml").read_text(encoding="utf-8"))
    table["domain"]["cells"] = [16, 16]
    search = searched(scalar_problem(Condensation(prepare(read_tables(table)).system).problem))
    assert len(search.points) == 3
    assert search.cells <= 15
