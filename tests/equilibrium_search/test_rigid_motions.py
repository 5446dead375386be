"""Rigid motions meet no resistance, however far: limits that a load passes by little; soft springs are no motions."""

from __future__ import annotations

import condensed
import numpy as np
import pytest
from scenes import Table, block, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.equilibrium_search.rigid_motions import EPSILON, with_motions
from hvi_fenicsx.equilibrium_search.thresholds import DEFAULT
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem

PEAK = 1e6
TRESCA = {"law": "tresca", "yield_traction": PEAK, "reference_slip": 1e-6}


def of_scene(table: Table) -> CondensedProblem:
    return Condensation(prepare(read_tables(table)).system).problem


def test_a_free_block_has_the_motions_of_geometry_and_no_resistance_to_them() -> None:
    given = of_scene(block(6, 5e5, 1e6, TRESCA))
    problem = scalar_problem(given)
    motions, bounded = problem.motions, np.isfinite(problem.lower)
    assert motions is not None
    assert len(motions.pivots) == 3
    along = motions.shapes[:, ~bounded[motions.pivots]]
    np.testing.assert_array_equal(along[:, 0], np.where(bounded, 0.0, 1.0))
    across = motions.shapes[:, bounded[motions.pivots]]
    assert not across[~bounded].any()
    x = given.points[bounded, 0]
    line = np.column_stack([np.ones_like(x), x])
    np.testing.assert_allclose(
        across[bounded], line @ np.linalg.lstsq(line, across[bounded], rcond=None)[0], atol=1e-12
    )
    size = np.abs(problem.stiffness) @ np.abs(motions.shapes)
    assert np.all(np.abs(problem.stiffness @ motions.shapes) <= problem.size * EPSILON * size)
    np.testing.assert_allclose(problem.stiffness, given.stiffness, atol=1e-13 * np.abs(given.stiffness).max())


@pytest.mark.parametrize("share", [1e-10, 1e-12])
def test_a_weak_spring_is_no_rigid_motion(share: float) -> None:
    """Two pairs of points with a spring between them, so weak that eigenvalues alone do not tell."""
    stiffness = np.kron(np.eye(2), condensed.chain(2, 1.0))
    stiffness[1:3, 1:3] += share * np.array([[1.0, -1.0], [-1.0, 1.0]])
    np.testing.assert_array_equal(with_motions(stiffness, DEFAULT.cells)[0], stiffness)


@pytest.mark.parametrize(("lifted", "points"), [(-1e-7, 1), (1e-7, 0), (1e-9, 0)])
def test_a_tall_block_at_a_wall_that_is_lifted_by_little_has_no_equilibrium(lifted: float, points: int) -> None:
    """Nothing holds it but the floor, which only pushes; rounding held it far above, and that was told as a point."""
    slip = 0.02e6 / 2.15e11
    teeth = {"law": "sawtooth", "drops": 3, "peak_traction": 1e6, "residual_traction": 2.5e5, "delta": slip}
    table = model(8, 1e6, 1e6, teeth)
    table["domain"]["size"] = [0.01, 1.0]
    table["boundary"]["press"]["traction"] = [0.0, f"{1e6 * lifted!r} - 1e6*(1 - 2*x/0.01)"]
    search = Enumeration(problem=scalar_problem(of_scene(table)))
    search.start()
    assert search.run(lambda: search.cells > 50, lambda _: None)
    assert len(search.points) == points
