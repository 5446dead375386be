"""The weighed balance of forces: against sampled points of cells, known stationary points, and its own dual."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from enumeration import Floor, polyline
from scenes import DELTA, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.equilibrium_search.arcs import FREE, chain
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.scalar_problem import ScalarProblem
from hvi_fenicsx.equilibrium_search.weighed_balance import Split, allowed, weighed
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
    t = problem.arcs.rates(np.clip(x, low + 1e-9, high - 1e-9))
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
            assert proof.total <= 0.0
            smaller = proof.smaller(*ends)
            assert smaller is not None
            assert np.all((smaller[0] <= point.x) & (point.x <= smaller[1]))
