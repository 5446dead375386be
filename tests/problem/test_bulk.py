"""Why: matrix, force, residual and energies are of one operator; if they differ, another problem is certified.

Each is held to the matrix, for steel and for rubber, whose dilatation is averaged by vertex.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dolfinx import fem
from scenes import STEEL

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.problem.problem import Problem

RUBBER: dict[str, Any] = {"model": "plane_strain", "youngs_modulus": 1e6, "poisson_ratio": 0.499}


def composed(material: dict[str, Any]) -> Problem:
    return prepare(
        read_tables(
            {
                "domain": {"shape": "rectangle", "size": [2.0, 1.0], "cells": [6, 4]},
                "material": material,
                "body": {"force": [0.0, -1e3]},
                "boundary": {
                    "wall": {"on": "left", "displacement": [0.0, 0.0]},
                    "pull": {"on": "right", "traction": ["1e4*y", 0.0]},
                },
            }
        )
    ).problem


def bent(problem: Problem) -> fem.Function:
    u = fem.Function(problem.space)
    u.interpolate(lambda x: np.stack([np.sin(x[0]) * x[1], x[0] * x[1] ** 2]))
    return u


@pytest.mark.parametrize("material", [STEEL, RUBBER], ids=["steel", "rubber"])
def test_force_and_residual_are_those_of_the_matrix(material: dict[str, Any]) -> None:
    problem = composed(material)
    u, bulk = bent(problem), problem.bulk
    assert bool(bulk.averaged) is (material is RUBBER)
    wanted = (bulk.matrix() * u.x.petsc_vec).array
    size = np.abs(wanted).max()
    assert bulk.force(u).ravel() == pytest.approx(wanted, abs=1e-12 * size)
    loads = list(problem.linear.values())
    load = bulk.residual_in(problem.space, fem.Function(problem.space), loads).ravel()
    assert np.abs(load).max() > 0
    assert bulk.residual_in(problem.space, u, loads).ravel() == pytest.approx(load - wanted, abs=1e-12 * size)


def test_the_energies_of_the_cells_add_up_to_that_of_the_matrix() -> None:
    problem = composed(STEEL)
    u = bent(problem)
    wanted = u.x.petsc_vec.dot(problem.bulk.matrix() * u.x.petsc_vec)
    assert problem.bulk.energy_by_cell(u).sum() == pytest.approx(wanted, rel=1e-12)
    assert problem.bulk.force_in(problem.space, u).values().ravel() @ u.x.array == pytest.approx(wanted, rel=1e-12)
