"""Solver and certificate against every stationary point there is, found by brute force without them (enumeration.py).

Nonmonotone laws have several solutions and the solver may end in any: so each that it certifies must be in the list,
and the certificate must accept all of the list, call minimisers and saddles what they are, and refuse all else.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from dolfinx import fem
from enumeration import Floor, Point, polyline
from scenes import DELTA, Table, block, context_of, displacement, energy, far, model, points, solved

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.certify.certificate import Certificate, examine
from hvi_fenicsx.solvers import quadratic
from hvi_fenicsx.workflow import Preparation, Solution

Array = npt.NDArray[np.float64]
Graph = list[tuple[float, float]]
TOLERANCE = 1e-8


def paper(gamma1: float) -> Graph:
    return [(0.0, 0.0), (DELTA, gamma1), (DELTA, gamma1 / 2)]


SAWTOOTH: Graph = [(0, 0), (4e-6, 8e5), (4e-6, 3e5), (9e-6, 9e5), (9e-6, 2e5)]
RISING: Graph = [(0, 0), (5e-6, 2e5), (5e-6, 8e5), (1.2e-5, 9e5), (1.2e-5, 1e5)]
TRESCA: Graph = [(0, 0), (0, 7e5)]


@dataclass(frozen=True)
class Case:
    """A grid, its loads and its law."""

    cells: int
    pull: float
    press: float
    graph: Graph = field(hash=False)
    wall: bool = True

    @functools.cached_property
    def floor(self) -> Floor:
        """For the oracle."""
        return Floor(self.cells, self.pull, self.press, polyline(self.graph), self.wall)

    @functools.cached_property
    def stationary(self) -> list[Point]:
        """All solutions."""
        return self.floor.stationary()

    def scene(self, **solver: Any) -> Table:
        """For the solver."""
        law = {"law": "graph", "points": [list(p) for p in self.graph]}
        make = model if self.wall else block
        return make(self.cells, self.pull, self.press, law, **solver)

    def __str__(self) -> str:
        return f"{self.cells}-{self.pull:g}-{self.press:g}-{len(self.graph)}-{max(t for _, t in self.graph):g}"


@functools.cache
def pushed_block(ratio: float) -> Case:
    """A free block, pushed with a share of the peak strength of its floor."""
    return Case(3, ratio * 1e6, 1e6, paper(1e6), wall=False)


THREE = Case(3, 6e6, 1e6, paper(3e6))
LOADS = [(1e6, 1e6), (3e6, 1e6), (6e6, 1e6), (6e6, 1e5), (-4e6, 3e5)]
FAST = [
    THREE,
    *(Case(n, *load, paper(g)) for n in (1, 2) for load in LOADS[n - 1 :: 2] for g in (1e3, 1e6, 1e7)),
    *(Case(3, *load, paper(1e7)) for load in LOADS[1:]),
    *(Case(2, *load, graph) for load in LOADS[1::2] for graph in (SAWTOOTH, RISING, TRESCA)),
    Case(3, 3e6, 1e6, TRESCA),
    *(pushed_block(r) for r in (0.3, 0.55, 0.7, 0.8)),
]
LONG = [
    *(Case(4, *load, paper(g)) for load in LOADS for g in (1e6, 3e6, 1e7)),
    *(Case(3, *load, graph) for load in LOADS for graph in (SAWTOOTH, RISING)),
]
CASES = [*FAST, *(pytest.param(case, marks=pytest.mark.long) for case in LONG)]
everywhere = pytest.mark.parametrize("case", CASES, ids=str)


@functools.cache
def prepared(case: Case) -> Preparation:
    return prepare(read_tables(case.scene(tolerance=TOLERANCE)))


@functools.cache
def found_by_solver(case: Case) -> Solution:
    """What the solver makes of a case."""
    return solved(case.scene(tolerance=TOLERANCE))


def as_function(case: Case, u: Array) -> fem.Function:
    """A nodal field of the oracle (m) as the package's nondimensional function."""
    problem = prepared(case).problem
    x = problem.space.tabulate_dof_coordinates()[:, :2]
    row = np.rint(x * case.cells).astype(int) @ [1, case.cells + 1]
    function = fem.Function(problem.space)
    function.x.array[:] = (u[row] / problem.scales.displacement).ravel()
    return function


def certified(case: Case, u: Array) -> Certificate:
    return examine(prepared(case).problem, as_function(case, u), TOLERANCE).certificate


def listed(case: Case, x: Array, u: Array, tolerance: float = 1e-6) -> list[Point]:
    """The points of the list that a nodal field is."""
    row = np.rint(x * case.cells).astype(int) @ [1, case.cells + 1]
    return [p for p in case.stationary if far(u, p.u[row]) < tolerance]


def test_the_paper_sized_grid_has_two_minimisers_and_a_saddle_on_the_kink() -> None:
    """physics.md, found there by other means."""
    assert [p.on_concave_kink for p in THREE.stationary] == [False, False, True]
    assert abs(THREE.stationary[-1].u - DELTA).min() < 1e-20


@pytest.mark.parametrize(("ratio", "number"), [(0.55, 2), (0.7, 6), (0.8, 2), (0.9, 0), (0.97, 0)])
def test_the_metastable_block_has_as_many_solutions_as_were_counted(ratio: float, number: int) -> None:
    """physics.md again: below the peak strength the solutions end before λ_peak does."""
    assert len(pushed_block(ratio).stationary) == number


@everywhere
def test_what_the_solver_certifies_is_in_the_list(case: Case) -> None:
    found = found_by_solver(case)
    assert found.exit_code == 0
    matches = listed(case, points(found), displacement(found))
    assert len(matches) == 1
    assert energy(found) == pytest.approx(matches[0].energy, rel=1e-8)


@everywhere
def test_the_solver_ends_in_a_minimiser(case: Case) -> None:
    """The energy falls in each convex step and both sides of a kink are tried: a saddle is no place to stay."""
    found = found_by_solver(case)
    assert not listed(case, points(found), displacement(found))[0].on_concave_kink
    assert found.examination is not None
    assert found.examination.certificate.second_order == "local minimiser"


@pytest.mark.parametrize("case", [c for c in FAST if c.wall and c.cells > 1], ids=str)
def test_from_the_wrong_branch_the_solver_ends_in_the_list(case: Case) -> None:
    """Starts on the floor with random slips, on any piece of the law; a metastable block might slide away from them."""
    random = np.random.default_rng(3)
    for size in (0.1, 1.0, 10.0):
        u = size * DELTA * random.normal(size=case.floor.load.size)
        u[case.floor.normal] = 0.0
        u[np.setdiff1d(np.arange(u.size), case.floor.free)] = 0.0
        assert len(reached(case, u.reshape(-1, 2))) == 1


def reached(case: Case, u: Array) -> list[Point]:
    """The points of the list that the solver reaches from a start."""
    ready = prepared(case)
    method = quadratic.choose(ready.options, ready.system)(context_of(ready))
    start = ready.system.load.duplicate()
    start.array[:] = as_function(case, u).x.array
    found = method.solve(start)
    assert found.converged
    end = found.u.x.array.reshape(-1, 2) * ready.problem.scales.displacement
    return listed(case, ready.problem.space.tabulate_dof_coordinates()[:, :2], end)


@everywhere
def test_started_in_a_solution_the_solver_stays_there_unless_it_is_a_saddle(case: Case) -> None:
    """From a saddle, which hides a descent, it must go on to a lower point."""
    for point in case.stationary:
        (end,) = reached(case, point.u)
        assert (end.energy < point.energy - 1e-9 * abs(point.energy)) == point.on_concave_kink


@everywhere
def test_the_certificate_accepts_every_stationary_point_and_knows_its_kind(case: Case) -> None:
    for point in case.stationary:
        verdict = certified(case, point.u)
        assert verdict.passed
        assert verdict.second_order == ("not a minimiser" if point.on_concave_kink else "local minimiser")


REFUSED = [c for c in FAST if c.cells < 3 or c is THREE]
QUICK = [THREE, *(c for c in REFUSED if c.cells == 2 and c.pull == 6e6 and c.press == 1e5)]
"""One of three cells each way; of two, each law under the one load that lifts the floor."""


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=[] if c in QUICK else [pytest.mark.long]) for c in REFUSED], ids=str
)
def test_the_certificate_refuses_every_single_displacement_that_is_off(case: Case) -> None:
    """By a millionth of the largest one, at any vertex the wall leaves, to either side."""
    for point in case.stationary:
        step = 1e-6 * np.max(np.abs(point.u))
        for dof, sign in itertools.product(case.floor.free, (-1, 1)):
            u = point.u.copy().ravel()
            u[dof] += sign * step
            assert not certified(case, u.reshape(-1, 2)).passed, (dof, sign)


@pytest.mark.parametrize("case", [THREE, pushed_block(0.7), Case(2, -4e6, 3e5, SAWTOOTH)], ids=str)
def test_points_on_a_concave_kink_are_saddles_and_the_others_minimisers(case: Case) -> None:
    """The words are held to the energy itself, at nearby admissible displacements."""
    random, floor = np.random.default_rng(7), case.floor
    for point in case.stationary:
        step = 1e-5 * np.max(np.abs(point.u))
        trials = [step * sign * np.eye(floor.load.size)[dof] for dof in floor.tangential for sign in (-1, 1)]
        trials += [step * random.normal(size=floor.load.size) for _ in range(200)]
        nearby = [_lifted(floor, point.u.ravel() + t * np.isin(np.arange(t.size), floor.free)) for t in trials]
        lowest = min(floor.energy(u) for u in nearby) - point.energy
        assert (lowest < 0) == point.on_concave_kink


def _lifted(floor: Floor, u: Array) -> Array:
    u[floor.normal] = np.maximum(u[floor.normal], 0.0)
    return u


@pytest.mark.parametrize("ratio", [0.9, 0.97])
def test_where_the_list_is_empty_the_solver_says_that_it_found_nothing(ratio: float) -> None:
    found = solved(pushed_block(ratio).scene())
    assert found.exit_code == 4
    assert found.solvability.state == "metastable"
    assert "no equilibrium found" in found.reason
