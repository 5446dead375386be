"""A problem at a factor against one that is composed of the multiplied values."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import fem
from scenes import STEEL, Table, quadratic_linear

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.certify import certificate
from hvi_fenicsx.problem.problem import FactoredProblem
from hvi_fenicsx.problem.vectors import assembled, nodal
from hvi_fenicsx.runtime import forms

FACTOR = 0.3


def scene(factor: float = 1.0) -> Table:
    """Heated, pulled, moved by a formula and by a number; a constant pressure sets the scales."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [4, 2]},
        "material": {**STEEL, "thermal_expansion": 1e-5},
        "body": {"temperature": 0.1 * factor},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, 1e-7 * factor]},
            "grip": {"on": "right", "displacement": [f"{factor}*1e-7*(1 + y)", "free"]},
            "press": {"on": "top", "traction": [0.0, -1e8]},
            "floor": {"on": "bottom", "contact": {"gap": 1e-6}, "friction": quadratic_linear(1e6)},
        },
    }


def test_loads_and_displacements_are_those_of_the_scene_with_multiplied_values() -> None:
    problem = prepare(read_tables(scene())).problem
    wanted = prepare(read_tables(scene(FACTOR)))
    made = FactoredProblem(problem, ["body.temperature", "wall.displacement", "grip.displacement"])
    made.at(7.0)
    found = made.at(FACTOR)
    for name, form in wanted.problem.linear.items():
        np.testing.assert_allclose(nodal(found.linear[name]), nodal(form), rtol=0, atol=1e-14)
    for one, other in zip(found.prescribed, wanted.problem.prescribed, strict=True):
        values = np.zeros((2, len(problem.points) * 2))
        one.condition.set(values[0])
        other.condition.set(values[1])
        np.testing.assert_allclose(values[0], values[1], rtol=0, atol=1e-15)
    strain = assembled(forms.compiled(found.bulk.strains["body.temperature"]))
    np.testing.assert_allclose(strain.array, wanted.system.forces["body.temperature"].array, rtol=0, atol=1e-14)


@pytest.mark.parametrize("factor", [0.0, FACTOR, 1.0])
def test_the_certificate_at_a_factor_passes_for_its_own_solution_alone(factor: float) -> None:
    """Solved as a scene of its own; at another factor the same displacement fails."""
    from hvi_fenicsx import solve

    solution = solve(read_tables(scene(factor)), estimate=False)
    problem = prepare(read_tables(scene())).problem
    made = FactoredProblem(problem, ["body.temperature", "wall.displacement", "grip.displacement"])
    assert solution.solve_result is not None
    u = fem.Function(problem.space)
    u.x.array[:] = solution.solve_result.u.x.array * (
        solution.problem.scales.displacement / problem.scales.displacement
    )
    assert certificate.examine(made.at(factor), u, 1e-8).certificate.passed
    assert not certificate.examine(made.at(factor + 0.01), u, 1e-8).certificate.passed
