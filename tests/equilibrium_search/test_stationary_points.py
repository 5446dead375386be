"""All stationary points and the lowest one against enumeration by brute force, closed forms and samples."""

from __future__ import annotations

import dataclasses
import functools
import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pytest
from array_enumeration import stationary
from condensed import bonds, graph
from condensed import problem as condensed
from enumeration import Floor, polyline
from scenes import DELTA, block, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.equilibrium_search import relaxation
from hvi_fenicsx.equilibrium_search.arcs import FREE, ArcTable, arcs_of, chain
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.convex_programme import convex_chains
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.lowest import LowestSearch
from hvi_fenicsx.equilibrium_search.relaxation import Relaxation
from hvi_fenicsx.equilibrium_search.rigid_balance import RigidBalance
from hvi_fenicsx.equilibrium_search.scalar_problem import Box, ScalarProblem
from hvi_fenicsx.equilibrium_search.stationarity import Kind, StationaryPoint
from hvi_fenicsx.equilibrium_search.thresholds import LIMITS
from hvi_fenicsx.errors import SolverError
from hvi_fenicsx.laws.traction_graph import TractionGraph
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.reduced.condensed_problem import Bonds

Array = npt.NDArray[np.float64]
Graph = Sequence[tuple[float, float]]
SAWTOOTH = ((0, 0), (4e-6, 8e5), (4e-6, 3e5), (9e-6, 9e5), (9e-6, 2e5))
SOFTENING = ((0, 0), (2e-6, 9e5), (1.1e-5, 0))
LOADS = [(1e6, 1e6), (3e6, 1e6), (6e6, 1e6), (6e6, 1e5), (-4e6, 3e5)]


def paper(gamma1: float) -> Graph:
    return ((0.0, 0.0), (DELTA, gamma1), (DELTA, gamma1 / 2))


Case = tuple[int, float, float, Graph, bool]
FAST: list[Case] = [
    (3, 6e6, 1e6, paper(3e6), True),
    (2, -4e6, 3e5, SAWTOOTH, True),
    (2, 6e6, 1e5, SOFTENING, True),
    (1, 7e5, 1e6, paper(1e6), False),
]
LONG: list[Case] = [
    *((n, *load, g, True) for n in (1, 2) for load in LOADS for g in (paper(3e6), paper(1e7), SAWTOOTH, SOFTENING)),
    *((3, *load, g, True) for load in LOADS for g in (paper(3e6), SAWTOOTH)),
    *((3, r * 1e6, 1e6, paper(1e6), False) for r in (0.3, 0.55, 0.7, 0.8, 0.9)),
]
everywhere = pytest.mark.parametrize("case", [*FAST, *(pytest.param(c, marks=pytest.mark.long) for c in LONG)], ids=str)


@functools.cache
def oracle(case: Case) -> Floor:
    cells, pull, press, graph, wall = case
    return Floor(cells, pull, press, polyline(graph), wall)


@functools.cache
def problem_of(case: Case) -> tuple[ScalarProblem, float]:
    """The condensed problem of the package, and the unit of its energy."""
    cells, pull, press, graph, wall = case
    law = {"law": "graph", "points": [list(p) for p in graph]}
    system = prepare(read_tables((model if wall else block)(cells, pull, press, law))).system
    return scalar_problem(Condensation(system).problem), system.problem.scales.energy


def found(problem: ScalarProblem) -> Enumeration:
    search = Enumeration(problem=problem)
    search.start()
    assert search.run(lambda: False, lambda _: None)
    return search


def lowest(problem: ScalarProblem) -> LowestSearch:
    search = LowestSearch(problem=problem)
    search.start()
    assert search.run(lambda: False, lambda _: None)
    return search


@everywhere
def test_all_points_of_a_floor_are_those_of_brute_force(case: Case) -> None:
    problem, unit = problem_of(case)
    wanted = oracle(case).stationary()
    points = sorted(found(problem).points, key=lambda p: p.energy)
    assert len(points) == len(wanted)
    np.testing.assert_allclose([p.energy * unit for p in points], [p.energy for p in wanted], rtol=1e-9)
    assert [p.kind is Kind.SADDLE for p in points] == [p.on_concave_kink for p in wanted]


@everywhere
def test_the_lowest_energy_is_that_of_brute_force(case: Case) -> None:
    problem, unit = problem_of(case)
    wanted = oracle(case).stationary()
    if case[4] or case[1] < case[3][-1][1]:  # held by the wall, or by what is left of its bonds
        assert lowest(problem).upper * unit == pytest.approx(wanted[0].energy, rel=1e-9)
    else:
        with pytest.raises(SolverError, match="no lowest energy"):
            lowest(problem)


@everywhere
def test_cells_made_smaller_by_the_balance_of_bodies_keep_all_points(case: Case) -> None:
    problem, _ = problem_of(case)
    balance, random = RigidBalance(problem), np.random.default_rng(0)
    for point in found(problem).points:
        for reach in (1e-3, 1.0, 1e3, 1e6):
            low = np.maximum(problem.lower, point.x - reach * random.uniform(0.01, 1.0, problem.size))
            high = np.minimum(problem.upper, point.x + reach * random.uniform(0.01, 1.0, problem.size))
            ends = balance.tightened(low, high)
            assert ends is not None
            assert np.all((point.x >= ends[0]) & (point.x <= ends[1]))


def random_bonds(random: np.random.Generator, unknown: int) -> tuple[Bonds, float]:
    """A law with drops, now and then with a jump at rest, and one of its joints."""
    points = [[0.0, 0.0]]
    if random.random() < 0.4:
        points.append([0.0, random.uniform(0.1, 1.0) * random.choice([1.0, 1.0, -1.0])])
    for x in np.sort(random.uniform(0.2, 2.0, random.integers(1, 3))):
        points += [[x, random.uniform(0.0, 1.5)], [x, random.uniform(0.0, 1.0)]]
    law = graph(points, one_sided=bool(random.random() < 0.3))
    return bonds(law, [unknown], 1.0, random.choice([1.0, -1.0])), points[random.integers(0, len(points))][0]


QUICK = [5, 13, 16, 28, 29, 38]
MANY = [pytest.param(seed, marks=pytest.mark.long) for seed in range(100) if seed not in QUICK]


@pytest.mark.parametrize("seed", [*QUICK, *MANY])
def test_all_points_where_bounds_lie_on_joints_are_those_of_brute_force(seed: int) -> None:
    random = np.random.default_rng(seed)
    n = int(random.integers(1, 4))
    half = random.normal(size=(n, n))
    laws, joints = zip(*(random_bonds(random, i) for i in range(n)), strict=True)
    kept = random.uniform(size=(2, n)) < 0.4
    given = condensed(
        half @ half.T + 0.05 * np.eye(n),
        random.normal(size=n),
        *laws,
        lower=np.where(kept[0], -np.array(joints), -np.inf),
        upper=np.where(kept[1], np.array(joints), np.inf),
    )
    problem = scalar_problem(given)
    wanted = stationary(problem)
    points = found(problem).points
    listed = [p.x for p in points]
    assert all(min(np.max(np.abs(x - y)) for y in listed) < 1e-8 * (1.0 + np.max(np.abs(x))) for x in wanted)
    assert all(min(np.max(np.abs(x - y)) for y in wanted) < 1e-8 * (1.0 + np.max(np.abs(x))) for x in listed)
    for point in points:
        _check_kind(problem, point, random)


def _check_kind(problem: ScalarProblem, point: StationaryPoint, random: np.random.Generator) -> None:
    """About a minimiser no energy is lower; about a saddle one is."""
    ways = np.vstack([np.eye(problem.size), -np.eye(problem.size), random.normal(size=(2000, problem.size))])
    places = [np.clip(point.x + 1e-5 * way, problem.lower, problem.upper) for way in ways]
    fall = point.energy - min(map(problem.energy, places))
    if point.kind is not Kind.UNDECIDED:
        assert (fall > 1e-14) == (point.kind is Kind.SADDLE)


def on_teeth(count: int, drop: float = 3.0) -> TractionGraph:
    """A traction that rises from 0 to `drop` within each unit of displacement and falls back to 0, `count` times."""
    points = [(0.0, 0.0)]
    for i in range(count):
        points += [(i + 1.0, drop), (i + 1.0, 0.0)]
    return TractionGraph.from_points(points, one_sided=True)


@pytest.mark.parametrize("teeth", [1, 3, 6])
def test_a_block_on_a_spring_over_teeth_has_two_equilibria_a_tooth_and_one(teeth: int) -> None:
    """By hand: k (x0 - x) ∈ ∂j(x) has one on each rising edge, one on each drop, one behind all of them."""
    k, x0 = 0.1, teeth + 5.0
    assert k * x0 < 3.0
    graph = on_teeth(teeth)
    problem = ScalarProblem(
        stiffness=np.array([[k]]),
        force=np.array([k * x0]),
        lower=np.array([-np.inf]),
        upper=np.array([np.inf]),
        chains=(chain(graph, 1.0, 1.0),),
    )
    rising = [(k * x0 + 3.0 * i) / (k + 3.0) for i in range(teeth)]
    wanted = sorted([*rising, *(i + 1.0 for i in range(teeth)), x0])
    points = sorted(found(problem).points, key=lambda p: float(p.x[0]))
    np.testing.assert_allclose([p.x[0] for p in points], wanted, rtol=1e-12)
    assert [p.kind for p in points] == [Kind.MINIMISER, Kind.SADDLE] * teeth + [Kind.MINIMISER]
    assert lowest(problem).upper == pytest.approx(min(p.energy for p in points), rel=1e-12)


def test_a_block_that_may_stand_anywhere_is_reported_as_a_continuum() -> None:
    """On the constant branch of its law, with a load equal to it."""
    graph = TractionGraph.from_points([(0, 0), (1, 2), (1, 1)])
    free = np.array([[0.0]])
    bounds = np.array([-5.0]), np.array([5.0])
    problem = ScalarProblem(
        stiffness=free, force=np.array([1.0]), lower=bounds[0], upper=bounds[1], chains=(chain(graph, 1.0, 1.0),)
    )
    assert any(not p.isolated for p in found(problem).points)


def random_graph(random: np.random.Generator) -> TractionGraph:
    points = [(0.0, 0.0)] if random.random() < 0.7 else [(0.0, 0.0), (0.0, random.uniform(0, 2))]
    for x in np.sort(random.uniform(0, 3, random.integers(1, 6))):
        points += [(x, t) for t in random.uniform(-1, 3, random.integers(1, 3))]
    return TractionGraph.from_points(points, one_sided=bool(random.random() < 0.3))


def hull(x: Array, y: Array) -> Array:
    """The lower convex hull of points at the points' own x."""
    kept: list[tuple[float, float]] = []
    for p in zip(x, y, strict=True):
        while len(kept) > 1 and _turns(kept[-2], kept[-1], p) <= 0.0:
            kept.pop()
        kept.append(p)
    return np.interp(x, *np.array(kept).T)


def _turns(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@pytest.mark.parametrize("seed", range(80))
def test_an_envelope_is_the_hull_of_samples_and_never_above_the_law(seed: int) -> None:
    random = np.random.default_rng(seed)
    graph, weight, sign = random_graph(random), random.uniform(0.3, 2.0), random.choice([-1.0, 1.0])
    low, high = np.sort(random.uniform(-4, 4, 2))
    added = random.uniform(0, 3) * random.integers(0, 2)
    table = ArcTable.of([chain(graph, weight, sign)])
    rows = convex_chains(table, np.array([low]), np.array([high]), np.array([added]))[0]
    arcs, envelope = arcs_of(rows), ArcTable.of([rows])
    inner = sign * graph.breaks
    x = np.unique(np.concatenate([np.linspace(low, high, 1500), inner[(inner > low) & (inner < high)]]))
    law = weight * graph.primitive(sign * x) + 0.5 * added * x * x
    values = np.concatenate([envelope.energy(np.array([v])) for v in x])
    slopes = [t for a in arcs for t in (a.rate(a.low), a.rate(a.high))]
    assert np.all(values <= law + 1e-12 * (1.0 + np.abs(law)))
    steepest = np.max(np.abs(np.diff(np.diff(law) / np.diff(x)))) if len(x) > 2 else 0.0
    assert np.max(np.abs(values - hull(x, law))) <= 1e-9 + steepest * (high - low) / 1500
    assert all(b >= a - 1e-9 * (1 + abs(a)) for a, b in itertools.pairwise(slopes))


@pytest.mark.parametrize("seed", range(8))
def test_no_point_of_a_box_is_below_its_bound(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound allows for rounding, so it must hold without any tolerance."""
    random = np.random.default_rng(seed)
    n = 6
    factor = random.normal(size=(n, n))
    problem = ScalarProblem(
        stiffness=factor @ factor.T / n,
        force=random.normal(size=n),
        lower=np.full(n, -np.inf),
        upper=np.full(n, np.inf),
        chains=(*(chain(random_graph(random), 1.0, 1.0) for _ in range(n - 1)), FREE),
    )
    low, high = np.sort(random.uniform(-3, 3, (2, n)), axis=0)
    for part in (0.5, 0.999):
        monkeypatch.setattr(relaxation, "LIMITS", dataclasses.replace(LIMITS, part=part))
        bound = Relaxation(problem).solve(Box.around(low, high, low)).bound
        samples = random.uniform(low, high, (300, n))
        assert min(problem.energy(x) for x in samples) >= bound
