"""All equilibria with laws of lengths, proven: by hand, against one component, choices of pieces, and a descent."""

from __future__ import annotations

import copy
import itertools
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from length_enumeration import stationary
from test_lengths import glued, random_graph, random_problem

import hvi_fenicsx as hvi
from hvi_fenicsx.laws.traction_graph import TractionGraph
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.stationary_points.all_points import Enumeration
from hvi_fenicsx.stationary_points.arcs import FREE, chain
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.length_cells import LengthCells
from hvi_fenicsx.stationary_points.lengths import Lengths
from hvi_fenicsx.stationary_points.point_list import StationaryPoint
from hvi_fenicsx.stationary_points.scalar_problem import ScalarProblem
from hvi_fenicsx.stationary_points.stationarity import Kind
from hvi_fenicsx.workflow import prepare

Array = npt.NDArray[np.float64]
SOFTENING = ((0.0, 0.0), (1.0, 2.0), (3.0, 0.0))


def one_vector(stiffness: Array, force: Array, points: tuple[tuple[float, float], ...]) -> ScalarProblem:
    none = np.full(2, np.inf)
    law = chain(TractionGraph.from_points(points), 1.0, 1.0)
    lengths = Lengths(unknowns=np.array([[0, 1, 0]]), factors=np.array([[1.0, 1.0, 0.0]]), opens=np.array([False]))
    return ScalarProblem(
        stiffness=stiffness, force=force, lower=-none, upper=none, chains=(FREE, FREE, law), lengths=lengths
    )


def searched(problem: ScalarProblem, most: int = 3000) -> Enumeration:
    search = Enumeration(problem=problem)
    search.start()
    search.run(lambda: search.cells >= most, lambda _: None)
    return search


def proven(problem: ScalarProblem) -> list[StationaryPoint]:
    search = searched(problem)
    assert search.open_cells == 0
    return sorted(search.points, key=lambda p: p.energy)


def assert_same(problem: ScalarProblem, found: list[StationaryPoint], wanted: list[Array], near: float) -> None:
    listed = [p.x for p in found]
    for some, others in ((wanted, listed), (listed, wanted)):
        for x in some:
            assert min(np.max(np.abs(x - y)) for y in others) < near * (1.0 + np.max(np.abs(x))), problem.arguments(x)


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.0])
def test_a_vector_on_equal_springs_follows_its_load(angle: float) -> None:
    """Along the load r/2 + g(r) = 2: on each piece of the law there is one such length."""
    way = np.array([np.cos(angle), np.sin(angle)])
    points = proven(one_vector(0.5 * np.eye(2), 2.0 * way, SOFTENING))
    by_length = sorted(points, key=lambda p: float(np.linalg.norm(p.x)))
    np.testing.assert_allclose([p.x for p in by_length], np.outer([0.8, 2.0, 4.0], way), atol=1e-12)
    assert [p.kind for p in by_length] == [Kind.MINIMISER, Kind.SADDLE, Kind.MINIMISER]


def test_a_vector_that_breaks_at_a_drop_rests_on_it_too() -> None:
    points = proven(one_vector(0.5 * np.eye(2), np.array([0.0, 2.0]), ((0.0, 0.0), (1.0, 2.0), (1.0, 0.0))))
    by_length = sorted(points, key=lambda p: float(p.x[1]))
    np.testing.assert_allclose([p.x for p in by_length], [[0.0, 0.8], [0.0, 1.0], [0.0, 4.0]], atol=1e-12)
    assert [p.kind for p in by_length] == [Kind.MINIMISER, Kind.SADDLE, Kind.MINIMISER]


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_a_vector_sticks_at_zero_while_its_load_is_within_the_ball(share: float) -> None:
    law = ((0.0, 1.0), (2.0, 0.0))
    points = proven(one_vector(0.1 * np.eye(2), share * np.array([0.6, -0.8]), ((0.0, 0.0), *law)))
    lengths = sorted(float(np.linalg.norm(p.x)) for p in points)
    # r/10 + 1 - r/2 = share, and r/10 = share behind the law
    wanted = [0.0, 2.5 * (1.0 - share), 10.0 * share] if share < 1.0 else [10.0 * share]
    np.testing.assert_allclose(lengths, wanted, atol=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_a_vector_on_unequal_springs_is_found_as_often_as_a_scan_of_secants_finds_it(seed: int) -> None:
    """With the secant κ = g/r the vector is (S + κ)⁻¹ f; along the law's graph its length passes r at each point."""
    random = np.random.default_rng(seed)
    root = random.normal(size=(2, 2))
    graph = random_graph(random)
    problem = one_vector(0.2 * root @ root.T + 0.02 * np.eye(2), random.normal(size=2), ((0.0, 0.0), (1.0, 1.0)))
    law = chain(graph, 1.0, 1.0)
    problem = replace(problem, chains=(FREE, FREE, law))
    r, g = list[Array](), list[Array]()
    positive = [a for a in law if a.high > 0.0]
    for a in positive:
        begin, end = max(a.low, 0.0), min(a.high, 1e4)
        at = np.unique(np.r_[np.linspace(begin, end, 20_001), np.geomspace(begin + 1e-3, end, 20_001)])[1:-1]
        r.append(at)
        g.append(np.array([a.rate(x) for x in at]))
        if np.isfinite(a.high):
            following = next(b for b in positive if b.low == a.high)
            g.append(np.linspace(a.rate(a.high), following.rate(a.high), 20_001))
            r.append(np.full(20_001, a.high))
    r_all, g_all = np.concatenate(r), np.concatenate(g)
    values, vectors = np.linalg.eigh(problem.stiffness)
    along = (problem.force @ vectors) / (values + (g_all / r_all)[:, None])
    rest = np.linalg.norm(along, axis=1) - r_all
    sticks = np.linalg.norm(problem.force) < positive[0].rate(0.0)
    assert len(proven(problem)) == np.count_nonzero(np.diff(np.sign(rest))) + sticks


@pytest.mark.parametrize("opening", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_where_other_components_are_held_the_law_is_one_of_one_component(seed: int, opening: bool) -> None:
    random = np.random.default_rng(seed)
    m = 2
    held = 0 if opening else 1
    laws = [chain(random_graph(random), 1.0, 1.0) for _ in range(m)]
    root = random.normal(size=(2 * m, 2 * m))
    ends = np.full(2 * m, np.inf)
    ends[held::2] = 0.0
    numbers = np.arange(2 * m).reshape(m, 2)
    problem = ScalarProblem(
        stiffness=0.1 * root @ root.T + 0.02 * np.eye(2 * m),
        force=random.normal(size=2 * m),
        lower=-ends,
        upper=ends,
        chains=(*[FREE] * (2 * m), *laws),
        lengths=Lengths(
            unknowns=np.column_stack([numbers, numbers[:, :1]]),
            factors=np.tile([1.0, 1.0, 0.0], (m, 1)),
            opens=np.full(m, opening),
        ),
    )
    alone = np.arange(1 - held, 2 * m, 2)
    scalars = ScalarProblem(
        stiffness=problem.stiffness[np.ix_(alone, alone)],
        force=problem.force[alone],
        lower=-ends[alone],
        upper=ends[alone],
        chains=tuple(laws),
    )
    found, wanted = proven(problem), proven(scalars)
    assert len(found) == len(wanted)
    np.testing.assert_allclose([p.x[alone] for p in found], [p.x for p in wanted], atol=1e-9)
    np.testing.assert_allclose([p.energy for p in found], [p.energy for p in wanted], rtol=1e-9)
    assert [p.kind for p in found] == [p.kind for p in wanted]


def softer(seed: int, m: int, k: int, share: float) -> ScalarProblem:
    problem = random_problem(seed, m, k, opening=bool(seed % 2))
    return replace(problem, stiffness=share * problem.stiffness)


def long(*cases: tuple[int, int, int, float]) -> list[object]:
    return [pytest.param(*case, marks=pytest.mark.long) for case in cases]


@pytest.mark.parametrize(
    ("seed", "m", "k", "share"),
    [
        *((seed, 1, 2, 0.3) for seed in (7, 14, 18, 41)),
        *long(*((seed, 1, 2, share) for seed in range(20) for share in (0.3, 1.0))),
        *long(*((seed, 2, 2, 0.5) for seed in range(6)), *((seed, 1, 3, 0.3) for seed in range(12))),
    ],
)
def test_all_points_are_those_of_each_choice_of_pieces(seed: int, m: int, k: int, share: float) -> None:
    problem = softer(seed, m, k, share)
    found = proven(problem)
    assert_same(problem, found, stationary(problem, 30), 1e-7)
    random = np.random.default_rng(seed)
    for point in found:
        ways = np.vstack([np.eye(problem.size), -np.eye(problem.size), random.normal(size=(2000, problem.size))])
        step, rounding = 1e-5 * (1.0 + np.max(np.abs(point.x))), 1e-14 * (1.0 + problem.energy_size(point.x))
        fall = point.energy - min(problem.energy(np.maximum(point.x + step * way, problem.lower)) for way in ways)
        if point.kind is not Kind.UNDECIDED:
            assert (fall > rounding) == (point.kind is Kind.SADDLE)


@pytest.mark.parametrize("seed", [18, pytest.param(3, marks=pytest.mark.long)])
def test_cells_made_smaller_keep_their_points(seed: int) -> None:
    problem = softer(seed, 1 + seed % 2, 2, 0.4)
    random, cells = np.random.default_rng(seed), LengthCells(problem)
    whole = cells.first()
    assert whole is not None
    for point, reach in itertools.product(proven(problem), (1e-3, 1.0, 1e6)):
        r = problem.lengths.of(point.x)
        middle = np.concatenate([point.x, r, np.zeros_like(r)])
        wide = reach * random.uniform(0.1, 1.0, (2, len(middle)))
        low, high = np.maximum(whole.low, middle - wide[0]), np.minimum(whole.high, middle + wide[1])
        low[-len(r) :], high[-len(r) :] = whole.low[-len(r) :], whole.high[-len(r) :]
        left = cells.tightened(replace(whole, low=low, high=high))
        assert left is not None
        assert np.all((middle >= left.low) | (np.arange(len(middle)) >= len(middle) - len(r)))
        assert np.all((middle <= left.high) | (np.arange(len(middle)) >= len(middle) - len(r)))


def test_a_ring_of_equilibria_is_no_proof_that_all_were_found() -> None:
    """Without springs a vector rests at each length at which its law bears nothing."""
    search = searched(one_vector(np.zeros((2, 2)), np.zeros(2), ((0, 0), (1, 1), (2, 0), (3, 1))), 500)
    assert search.open_cells > 0


def scene(cells: int) -> hvi.Scene:
    table = copy.deepcopy(glued())
    for body in ("lower", "upper"):
        table["domain"][body]["cells"] = [cells, (cells + 1) // 2]
    table["interface"]["glue"]["cohesion"]["points"][-1] = [2.5e-5, 0]
    table["boundary"]["pull"]["traction"] = [1.0e7, "2.4e7*(x - 0.5) - 4e6"]
    return hvi.Scene.model_validate(table)


@pytest.mark.long
@pytest.mark.parametrize("cells", [2, 4])
def test_all_equilibria_of_two_bodies_glued_together_are_proven_and_certified(cells: int) -> None:
    found = hvi.equilibria(scene(cells))
    assert (found.complete, found.proven) == (True, True)
    assert found.reason.startswith("all equilibria, proven")
    assert len(found.solutions) > 1
    assert set(found.kinds) == {"minimiser", "saddle"}
    assert all(solution.converged for solution in found.solutions)
    known = hvi.solve(scene(cells)).energy
    assert min(abs(solution.energy / known - 1.0) for solution in found.solutions) < 1e-8


@pytest.mark.parametrize("cells", [2, pytest.param(3, marks=pytest.mark.long)])
def test_all_points_of_two_bodies_are_those_of_each_choice_of_pieces(cells: int) -> None:
    """With three cells the broken plate rests on the other one, and could be lifted as far as one looks."""
    problem = scalar_problem(Condensation(prepare(scene(cells)).system).problem)
    assert_same(problem, proven(problem), stationary(problem, 6), 1e-7)
