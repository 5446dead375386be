"""Smoothed and curved laws as polylines: against samples, and their lowest energies against a fine grid."""

from __future__ import annotations

import condensed
import numpy as np
import pytest
from enumeration import Floor, polyline
from scenes import DELTA, model, quadratic_linear
from scipy.optimize import minimize

import hvi_fenicsx as hvi
from hvi_fenicsx import laws
from hvi_fenicsx.equilibrium_search.condensed_form import law_graph, scalar_problem
from hvi_fenicsx.equilibrium_search.lowest import LowestSearch
from hvi_fenicsx.laws.smoothing import registered
from hvi_fenicsx.typing import Array

MODEL = laws.QuadraticLinear(2.0, 1.0, 1.0)
TEETH = laws.Sawtooth(3.0, 1.0, 0.5, 3)
WEAKENING = laws.Exponential(2.0, 0.5, 1.0)
CURVED = [
    registered()["chks"]().relative(MODEL, 0.05),
    registered()["log_exp"]().relative(TEETH, 0.02),
    registered()["paper"]().relative(MODEL, 0.1),
    WEAKENING,
]


def near_and_far() -> Array:
    """Displacements near the pieces of a law, and some far away."""
    random = np.random.default_rng(1)
    return np.concatenate([random.uniform(-4, 4, 100_000), random.uniform(-1e6, 1e6, 1000)])


@pytest.mark.parametrize("law", CURVED, ids=lambda law: law.name)
def test_a_curved_law_is_as_near_to_its_polyline_as_is_said(law: laws.Superpotential) -> None:
    tolerance = 1e-7 * law.energy_scale
    found = law_graph(law, 1e6, tolerance)
    x = near_and_far()
    difference = np.abs(found.graph.primitive(x) + found.offset - law.value(x))
    assert np.max(difference) <= found.error <= tolerance
    assert np.max(difference) > 0.05 * found.error  # the bound is not idle


@pytest.mark.long
@pytest.mark.parametrize("law", CURVED, ids=lambda law: law.name)
@pytest.mark.parametrize("seed", range(2))
def test_the_lowest_energy_of_curved_laws_is_that_of_a_fine_grid(law: laws.Superpotential, seed: int) -> None:
    random = np.random.default_rng(seed)
    factor = random.normal(size=(2, 2))
    problem = condensed.problem(
        0.3 * factor @ factor.T + 0.1 * np.eye(2), random.uniform(0.5, 3.0, 2), condensed.bonds(law, [0, 1])
    )
    side = np.linspace(-30.0, 60.0, 226)
    values = np.array([[problem.energy(np.array([a, b])) for b in side] for a in side])
    best = np.argsort(values, axis=None)[:20]
    starts = np.column_stack([side[best // len(side)], side[best % len(side)]])
    runs = [minimize(problem.energy, x, method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-13}) for x in starts]
    wanted = min(float(run.fun) for run in runs)
    polylines = scalar_problem(problem, tolerance=1e-9 * abs(wanted))
    search = LowestSearch(problem=polylines)
    search.start()
    assert search.run(lambda: False, lambda _: None)
    assert search.upper == pytest.approx(wanted, rel=1e-8)
    assert search.lower - polylines.error <= wanted + 1e-12 * abs(wanted)


SMOOTHED = {"smoothing": "quadratic", "epsilon": 0.01}


def test_all_equilibria_of_the_smoothed_scene_and_its_lowest() -> None:
    """At small widths as many as those of the law itself, a little apart."""
    law = polyline([(0.0, 0.0), (DELTA, 3e6), (DELTA, 1.5e6)])
    wanted = [p.energy for p in Floor(3, 6e6, 1e6, law).stationary()]
    scene = hvi.read_tables(model(3, 6e6, 1e6, quadratic_linear(3e6), **SMOOTHED))
    found = hvi.equilibria(scene)
    assert found.complete
    assert [s.energy for s in found.solutions] == pytest.approx(wanted, rel=1e-4)
    assert all(s.converged for s in found.solutions)


@pytest.mark.parametrize("smoothing", ["paper", pytest.param("chks", marks=pytest.mark.long)])
def test_a_curved_scene_has_a_proven_lowest_energy(smoothing: str) -> None:
    smooth = {"smoothing": smoothing, "epsilon": 0.05}
    scene = hvi.read_tables(model(2, 6e6, 1e6, quadratic_linear(3e6), **smooth))
    found = hvi.equilibria(scene, lowest=True, gap=1e-6)
    assert found.proven
    assert found.solutions[0].converged
    assert found.lower_bound is not None
    assert found.lower_bound <= found.solutions[0].energy <= found.lower_bound * (1.0 - 1.1e-6)
    assert found.solutions[0].energy <= hvi.solve(scene).energy * (1.0 - 1e-9)


def test_the_equilibria_of_a_curved_scene_are_found_without_a_proof() -> None:
    """The paper's smoothing changes the law at zero slip, too; the smallest width leaves it near the other one."""
    scene = hvi.read_tables(model(3, 6e6, 1e6, quadratic_linear(3e6), smoothing="quadratic", epsilon=0.002))
    curved = hvi.read_tables(model(3, 6e6, 1e6, quadratic_linear(3e6), smoothing="paper", epsilon=0.002))
    found, near = hvi.equilibria(curved), hvi.equilibria(scene)
    assert (found.complete, found.proven) == (False, False)
    assert found.reason == "3 found, and there may be more: curved laws are searched without a proof"
    assert near.complete
    assert all(s.converged for s in found.solutions)
    assert found.kinds == near.kinds
    assert [s.energy for s in found.solutions] == pytest.approx([s.energy for s in near.solutions], rel=1e-2)
