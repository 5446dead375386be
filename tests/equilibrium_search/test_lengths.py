"""The lowest energy with laws of lengths: against problems of one component, dense grids, samples and random starts."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.optimize import minimize

import hvi_fenicsx as hvi
from hvi_fenicsx.equilibrium_search import relaxation
from hvi_fenicsx.equilibrium_search.arcs import FREE, chain
from hvi_fenicsx.equilibrium_search.lengths import Lengths
from hvi_fenicsx.equilibrium_search.lowest import LowestSearch
from hvi_fenicsx.equilibrium_search.relaxation import Relaxation
from hvi_fenicsx.equilibrium_search.scalar_problem import Box, ScalarProblem
from hvi_fenicsx.equilibrium_search.stationarity import Kind
from hvi_fenicsx.equilibrium_search.thresholds import LIMITS
from hvi_fenicsx.laws.traction_graph import TractionGraph
from hvi_fenicsx.workflow import prepare
from hvi_fenicsx.workflow.equilibria import Equilibria

Array = npt.NDArray[np.float64]
Table = dict[str, Any]
DROP = {"law": "graph", "points": [[0, 0], [9e-6, 3e6], [9e-6, 1.5e6]]}


def random_graph(random: np.random.Generator) -> TractionGraph:
    """Rising and falling edges and jumps, never below zero."""
    points = [(0.0, 0.0)] if random.random() < 0.5 else [(0.0, 0.0), (0.0, random.uniform(0, 2))]
    for x in np.sort(random.uniform(0, 2, random.integers(1, 4))):
        points += [(x, t) for t in random.uniform(0, 3, random.integers(1, 3))]
    return TractionGraph.from_points(points)


def random_problem(seed: int, m: int, k: int, *, opening: bool) -> ScalarProblem:
    """M vectors of k components, and an unknown without a law that must not be negative."""
    random = np.random.default_rng(seed)
    n = k * m + 1
    lower = np.full(n, -np.inf)
    lower[-1] = 0.0
    opens = random.random(m) < 0.7 if opening else np.zeros(m, dtype=bool)
    lower[: k * m : k][opens] = random.choice([0.0, -0.3, -np.inf], np.count_nonzero(opens))
    unknowns, factors = np.zeros((m, 3), dtype=np.int64), np.zeros((m, 3))
    unknowns[:, :k], factors[:, :k] = np.arange(k * m).reshape(m, k), random.uniform(0.5, 1.5, (m, k))
    root = random.normal(size=(n, n))
    return ScalarProblem(
        stiffness=root @ root.T / n + 0.05 * np.eye(n),
        force=2.0 * random.normal(size=n),
        lower=lower,
        upper=np.full(n, np.inf),
        chains=(*[FREE] * n, *(chain(random_graph(random), 1.0, 1.0) for _ in range(m))),
        lengths=Lengths(unknowns=unknowns, factors=factors, opens=opens),
    )


def proven(problem: ScalarProblem) -> LowestSearch:
    search = LowestSearch(problem=problem)
    search.start()
    assert search.run(lambda: search.boxes > 200, lambda _: None)
    return search


def parallel(seed: int, m: int, k: int, *, opening: bool) -> tuple[ScalarProblem, ScalarProblem]:
    """Vectors whose forces are parallel, and the same of one component each.

    With K_ij ≤ 0 for i ≠ j, Σ K_ij zᵢ·zⱼ ≥ Σ K_ij |zᵢ| |zⱼ|: the lowest vectors are parallel to the forces.
    """
    random = np.random.default_rng(seed)
    root = -random.uniform(0, 1, (m, m))
    coupling = root + root.T
    coupling += np.diag(0.2 - coupling.sum(axis=1))
    sizes, laws = random.uniform(0, 4, m), [chain(random_graph(random), 1.0, 1.0) for _ in range(m)]
    way = random.normal(size=k)
    way[0] = abs(way[0])
    force = np.outer(sizes, way / np.linalg.norm(way)).ravel()
    factors = np.zeros((m, 3))
    factors[:, :k] = random.uniform(0.5, 2.0, (m, k))
    unknowns = np.zeros((m, 3), dtype=np.int64)
    unknowns[:, :k] = random.permutation(k * m).reshape(m, k)
    turned, scale = unknowns[:, :k].ravel(), factors[:, :k].ravel()
    stiffness, pulled = np.zeros((k * m, k * m)), np.zeros(k * m)
    stiffness[np.ix_(turned, turned)] = scale[:, None] * np.kron(coupling, np.eye(k)) * scale
    pulled[turned] = scale * force
    none = np.full(k * m, np.inf)
    lengths = Lengths(unknowns=unknowns, factors=factors, opens=np.full(m, opening))
    vectors = ScalarProblem(
        stiffness=stiffness, force=pulled, lower=-none, upper=none, chains=(*[FREE] * (k * m), *laws), lengths=lengths
    )
    ends = np.full(m, np.inf)
    return vectors, ScalarProblem(stiffness=coupling, force=sizes, lower=-ends, upper=ends, chains=tuple(laws))


LARGE = [
    pytest.param(seed, 12, k, opening, marks=pytest.mark.long)
    for seed in range(6)
    for k in (2, 3)
    for opening in (False, True)
]


@pytest.mark.parametrize(("seed", "m", "k", "opening"), [(0, 4, 2, False), (1, 4, 3, False), (2, 4, 3, True), *LARGE])
def test_vectors_with_parallel_forces_are_a_problem_of_one_component(seed: int, m: int, k: int, opening: bool) -> None:
    vectors, scalars = parallel(seed, m, k, opening=opening)
    wanted, found = proven(scalars), proven(vectors)
    assert found.upper == pytest.approx(wanted.upper, rel=2e-8)
    np.testing.assert_allclose(vectors.lengths.of(found.x), np.abs(wanted.x), atol=1e-3)


@pytest.mark.parametrize("seed", [3, 7])
def test_one_vector_is_the_least_of_a_dense_grid(seed: int) -> None:
    """The unknown without a law is eliminated by hand."""
    problem = random_problem(seed, 1, 2, opening=False)
    found, factors = proven(problem), problem.lengths.factors[0, :2]
    far = 2.0 * float(np.max(factors) * np.abs(found.x).max()) + 1.0
    size, angle = np.meshgrid(np.linspace(0, far, 401), np.linspace(0, 2 * np.pi, 361))
    z = np.stack([size * np.cos(angle), size * np.sin(angle)], axis=-1).reshape(-1, 2)
    energies = _energies(problem, z / factors)
    best = minimize(
        lambda x: _energies(problem, x[None])[0],
        z[np.argmin(energies)] / factors,
        method="Nelder-Mead",
        options={"xatol": 1e-10, "fatol": 1e-14},
    ).fun
    assert found.lower <= best
    assert found.upper == pytest.approx(best, rel=1e-7)


def _energies(problem: ScalarProblem, x: Array) -> Array:
    s, f = problem.stiffness, problem.force
    whole = np.column_stack([x, np.maximum((f[2] - x @ s[:2, 2]) / s[2, 2], 0.0)])
    size = np.linalg.norm(x * problem.lengths.factors[0, :2], axis=1)
    law = np.select([size <= a.high for a in problem.chains[-1]], [a.at(size) for a in problem.chains[-1]])
    return np.asarray(0.5 * np.einsum("ij,jk,ik->i", whole, s, whole) - whole @ f + law)


CASES = [(seed, 2, 2, True) for seed in (0, 7)] + [(1, 2, 3, True), (11, 3, 2, False)]
MORE = [pytest.param(s, 3, k, o, marks=pytest.mark.long) for s in range(20, 30) for k in (2, 3) for o in (False, True)]


@pytest.mark.parametrize(("seed", "m", "k", "opening"), [*CASES, *MORE])
def test_no_random_start_ends_below_the_bound(seed: int, m: int, k: int, opening: bool) -> None:
    problem = random_problem(seed, m, k, opening=opening)
    found, random = proven(problem), np.random.default_rng(seed)
    least = min(_descended(problem, 2.0 * random.normal(size=problem.size)) for _ in range(4))
    assert found.lower <= least
    assert found.upper <= least + 1e-6 * abs(least)


def _descended(problem: ScalarProblem, x: Array) -> float:
    sides = [(None if np.isinf(low) else low, None) for low in problem.lower]
    x = np.maximum(x, problem.lower)
    for method in ("L-BFGS-B", "Powell"):
        x = np.maximum(minimize(problem.energy, x, method=method, bounds=sides).x, problem.lower)
    return problem.energy(x)


@pytest.mark.parametrize("opening", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_no_point_of_a_box_is_below_its_bound(seed: int, opening: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound allows for rounding, so it must hold without any tolerance."""
    problem = random_problem(seed, 3, 2, opening=opening)
    random = np.random.default_rng(seed)
    low = np.maximum(random.uniform(-3, 0, problem.size), problem.lower)
    low, high = problem.with_lengths(low, low + random.uniform(0.5, 3, problem.size))
    middle = 0.5 * (low[problem.size :] + high[problem.size :])
    low[problem.size :] = np.where(random.random(3) < 0.5, middle, low[problem.size :])
    samples = random.uniform(low[: problem.size], high[: problem.size], (2000, problem.size))
    inside = [x for x in samples if np.all(problem.arguments(x) >= low)]
    assert inside
    for part in (0.5, 0.999):
        monkeypatch.setattr(relaxation, "LIMITS", replace(LIMITS, part=part))
        bound = Relaxation(problem).solve(Box.around(low, high, low[: problem.size])).bound
        assert min(problem.energy(x) for x in inside) >= bound


def freed(problem: ScalarProblem, held: float) -> ScalarProblem:
    """The same problem where the last components of all vectors can move together, held by the laws alone."""
    motion = np.zeros(problem.size)
    members = problem.lengths.unknowns[:, 1]
    motion[members] = 1.0 / problem.lengths.factors[:, 1]
    motion /= np.linalg.norm(motion)
    rest = np.eye(problem.size) - np.outer(motion, motion)
    force = rest @ problem.force + held * motion
    return replace(problem, stiffness=rest @ problem.stiffness @ rest, force=force)


LOST = pytest.param(
    4,
    marks=[
        pytest.mark.long,
        pytest.mark.xfail(reason="bounds by cuts are too loose for it: no limit far away is found"),
    ],
)


@pytest.mark.parametrize("seed", [0, 1, 7, *(pytest.param(s, marks=pytest.mark.long) for s in (2, 3, 5, 6, 8)), LOST])
def test_the_lowest_energy_of_a_body_that_only_laws_hold_is_below_all_descents(seed: int) -> None:
    problem = random_problem(seed, 3, 2, opening=False)
    softening = TractionGraph.from_points([(0.0, 0.0), (0.1, 2.0), (1.5, 1.0)])
    laws = (*problem.chains[: problem.size], *(chain(softening, 1.0, 1.0) for _ in range(3)))
    problem = freed(replace(problem, chains=laws), 0.5)
    found, random = proven(problem), np.random.default_rng(seed)
    least = min(_descended(problem, 2.0 * random.normal(size=problem.size)) for _ in range(6))
    assert found.lower <= least
    assert found.upper <= least + 1e-6 * abs(least)


def space(cells: int) -> Table:
    """A steel cube on a floor with a law of |u_t|, pulled obliquely."""
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [cells] * 3},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
            "pull": {"on": "right", "traction": [6e6, 5e5, 0.0]},
            "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": DROP},
        },
    }


def glued() -> Table:
    """Two plates, glued with a law of opening and slip together, the upper one pulled and bent."""
    plate = {"shape": "rectangle", "size": [1.0, 0.5], "cells": [4, 2]}
    law = {"law": "graph", "points": [[0, 0], [2e-5, 1e7], [6e-5, 0]], "beta": 0.7}
    return {
        "domain": {"lower": plate, "upper": {**plate, "origin": [0.0, 0.5]}},
        "material": {"model": "plane_strain", "youngs_modulus": 7.0e10, "poisson_ratio": 0.33},
        "boundary": {
            "grip": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
            "pull": {"on": "upper.top", "traction": [1.0e7, "2.4e7*(x - 0.5)"]},
            "hold": {"on": "upper.left", "displacement": [0.0, "free"]},
        },
        "interface": {"glue": {"between": ["upper.bottom", "lower.top"], "contact": {"gap": 0.0}, "cohesion": law}},
    }


SMOOTHED = {"solver": {"smoothing": "chks", "epsilon": 0.05}}
SCENES = [
    pytest.param(space(2), id="friction in space"),
    pytest.param(space(1) | SMOOTHED, id="smoothed friction in space", marks=pytest.mark.long),
    pytest.param(glued(), id="cohesion", marks=pytest.mark.long),
]


@pytest.mark.parametrize("table", SCENES)
def test_the_lowest_equilibrium_of_a_scene_is_certified_and_a_run_is_not_below_its_bound(table: Table) -> None:
    scene = hvi.read_tables(table)
    found = hvi.equilibria(scene, lowest=True)
    assert found.proven
    assert found.lower_bound is not None
    assert found.kinds == ("minimiser",)
    assert found.solutions[0].converged
    assert found.solutions[0].energy == pytest.approx(found.lower_bound, rel=2e-8)
    assert hvi.solve(scene).energy >= found.lower_bound


def test_a_block_that_sticks_and_could_slide_off_has_one_minimiser_and_no_lowest_energy() -> None:
    """Bonds that break without a rest, and a load that they still bear: most descents run off, and end anywhere.

    The search for all has more cells than a test has time for; a saddle is among what it finds later.
    """
    law = {"law": "graph", "points": [[0, 0], [0, 1.2e4], [4e-5, 0]]}
    scene = hvi.read_tables(
        {
            "domain": {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [1, 1, 1]},
            "material": {"model": "three_dimensional", "youngs_modulus": 2e9, "poisson_ratio": 0.3},
            "boundary": {
                "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": law},
                "pull": {"on": "top", "traction": [1e3, 500.0, -1.2e3]},
            },
        }
    )
    prepared, asked = prepare(scene), itertools.count()
    searched = Equilibria(prepared)
    found = searched.find(lowest=False, gap=1e-8, stop=lambda: next(asked) > 560, report=lambda _: None)
    assert found.reason.startswith("1 found, and")
    assert [p.energy * prepared.problem.scales.energy for p in found.points] == pytest.approx(
        [hvi.solve(scene).energy], rel=1e-9
    )
    assert (found.points[0].kind, found.lower_bound) == (Kind.MINIMISER, None)
    lowest = hvi.equilibria(scene, lowest=True)
    assert (lowest.proven, lowest.lower_bound, len(lowest.solutions)) == (False, None, 0)
    assert "falls without limit" in lowest.reason


def test_where_the_energy_is_convex_the_only_equilibrium_is_proven_at_once() -> None:
    """Friction that never weakens; the search for the lowest energy knows nothing of it, and ends there too."""
    table = space(2)
    table["boundary"]["floor"]["friction"] = {"law": "tresca", "yield_traction": 4e6}
    scene = hvi.read_tables(table)
    found, lowest = hvi.equilibria(scene), hvi.equilibria(scene, lowest=True)
    assert (found.complete, found.proven, found.nodes, found.gap) == (True, True, 0, 0.0)
    assert found.reason.startswith("the only equilibrium, proven: the energy is convex")
    assert found.solutions[0].energy == pytest.approx(lowest.solutions[0].energy, rel=1e-10)
    assert lowest.nodes > 0
