"""Barriers of curved laws: against the flooding of a fine grid, and those of polylines; ways down stay below."""

from __future__ import annotations

import condensed
import numpy as np
import pytest
from curved import LAWS, enumerated, random_pair, two_bonds
from flooding import assert_levels, flooded_levels, joined_levels

from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.stationary_points.condensed_form import scalar_problem
from hvi_fenicsx.stationary_points.curved_laws import CurvedLaws
from hvi_fenicsx.stationary_points.found import Wanted
from hvi_fenicsx.stationary_points.landscapes import CurvedLandscape
from hvi_fenicsx.stationary_points.passes import Pass, passes
from hvi_fenicsx.stationary_points.point_list import StationaryPoint
from hvi_fenicsx.stationary_points.search import find
from hvi_fenicsx.stationary_points.stationarity import Kind
from hvi_fenicsx.stationary_points.thresholds import DEFAULT, DescentThresholds, Thresholds


def landscape(problem: CondensedProblem, thresholds: Thresholds = DEFAULT) -> CurvedLandscape:
    near = scalar_problem(problem, tractions=True, thresholds=thresholds)
    return CurvedLandscape(CurvedLaws(near=near, problem=problem))


def found(problem: CondensedProblem) -> tuple[list[StationaryPoint], tuple[Pass, ...]]:
    points = sorted(enumerated(problem).points, key=lambda p: p.energy)
    return points, passes(landscape(problem), points)


CASES = [
    ("narrow chks", (1.7, 1.6), 4),
    ("narrow chks", (2.4, 1.9), 3),
    ("teeth", (1.7, 1.6), 6),
    pytest.param("teeth", (2.4, 1.9), 12, marks=pytest.mark.long),
    ("paper", (1.7, 1.6), 4),
    ("exponential", (1.7, 1.6), 2),
    ("smoothed exponential", (1.7, 1.6), 2),
]


@pytest.mark.parametrize(("name", "load", "minimisers"), CASES)
def test_barriers_of_curved_laws_are_those_of_a_flooded_grid(
    name: str, load: tuple[float, float], minimisers: int
) -> None:
    problem = condensed.problem([[0.7, -0.2], [-0.2, 0.7]], load, condensed.bonds(LAWS[name], [0, 1]))
    points, joins = found(problem)
    assert sum(p.kind is Kind.MINIMISER for p in points) == minimisers
    wanted = flooded_levels(problem, points, np.linspace(-0.2, 3.0, 801))
    assert_levels(joined_levels(points, joins), wanted, above=5e-5, below=2e-4)


@pytest.mark.parametrize("seed", range(12))
def test_a_majorant_is_nowhere_below_the_laws_and_equal_to_them_at_its_point(seed: int) -> None:
    every = list(LAWS.values())
    problem, random = random_pair(seed, (every[seed % 6], every[(seed // 2) % 6])), np.random.default_rng(seed)
    land = landscape(problem)
    low, high = np.maximum(land.ends[0], -50.0), np.minimum(land.ends[1], 50.0)
    for x in [*np.clip(random.normal(0.0, 2.0, (10, 2)), low, high), np.maximum(low, 0.0)]:
        chains = land.majorants(x)
        for y in np.clip(x + random.normal(size=(100, 2)) * 10.0 ** random.uniform(-5.0, 2.0, (100, 1)), low, high):
            for bonds, i in zip(problem.bonds, (0, 1), strict=True):
                ends = bonds.law.value(bonds.signs[0, 0] * np.array([x[i], y[i]]))
                arc = next(a for a in chains[i] if y[i] <= a.high)
                assert arc.at(float(y[i])) >= bonds.weights[0] * (ends[1] - ends[0]) - 1e-12 * (1.0 + abs(ends[1]))
                assert all(a.slope >= 0.0 for a in chains[i])
        for i in (0, 1):
            assert min(abs(a.at(float(x[i]))) for a in chains[i] if a.low <= x[i] <= a.high) < 1e-12


@pytest.mark.long
def test_a_step_down_is_nowhere_higher_than_its_begin() -> None:
    one_step = Thresholds(descent=DescentThresholds(curved_steps=1))
    problem = two_bonds(LAWS["teeth"], 0.7)
    points, _ = found(problem)
    land, share = landscape(problem, one_step), np.linspace(0.0, 1.0, 201)[:, None]
    for saddle in (p for p in points if p.kind is Kind.SADDLE):
        x = saddle.x + np.array([1e-3, -2e-3])
        for _ in range(100):
            y = land.lower(x)
            energies = [land.energy(z) for z in x + share * (y - x)]
            assert max(energies) <= land.energy(x) + 1e-12
            x = y


def test_with_a_small_width_the_barriers_are_those_of_polylines() -> None:
    law = condensed.graph([(0, 0), (1, 1), (1, 0.3)])
    heights = []
    for one in (law, registered()["chks"]().relative(law, 1e-5)):
        problem = condensed.problem([[0.6, -0.1], [-0.1, 0.6]], (1.3, 1.1), condensed.bonds(one, [0, 1]))
        near = scalar_problem(problem, tractions=True)
        wanted = Wanted(curved=CurvedLaws(near=near, problem=problem) if near.error else None)
        known = find(near, wanted, lambda: False, lambda _: None)
        assert known.complete
        energies = [p.energy for p in known.points]
        heights.append([energies[p.saddle] - energies[m] for p in known.passes for m in p.minimisers])
    assert len(heights[0]) == len(heights[1]) >= 4
    np.testing.assert_allclose(sorted(heights[1]), sorted(heights[0]), rtol=1e-2)
