"""Rigid motions meet no resistance, however far: limits that a load passes by little; soft springs are no motions."""

from __future__ import annotations

import pytest
from scenes import Table, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.enumeration import Enumeration
from hvi_fenicsx.reduced.condensation import Condensation
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem


def of_scene(table: Table) -> CondensedProblem:
    return Condensation(prepare(read_tables(table)).system).problem


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
