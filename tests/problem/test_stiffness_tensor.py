"""Why: the compliance of a facet follows from the stiffness of its cell; Hooke's law in closed form is the referee."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import STEEL

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.problem.elastic_operator import stiffness_tensor
from hvi_fenicsx.problem.problem import Problem

RUBBER: dict[str, Any] = {"model": "plane_strain", "youngs_modulus": 1e6, "poisson_ratio": 0.499}
SOLID: dict[str, Any] = {"model": "three_dimensional", "youngs_modulus": 3e9, "poisson_ratio": 0.3}


def composed(material: dict[str, Any]) -> Problem:
    d = 3 if material["model"] == "three_dimensional" else 2
    domain = {"shape": "box" if d == 3 else "rectangle", "size": [2.0, 1.0, 1.0][:d], "cells": [4, 2, 2][:d]}
    scene = {
        "domain": domain,
        "material": material,
        "boundary": {
            "a": {"on": "left", "displacement": [0.0] * d},
            "b": {"on": "right", "traction": [1e4, 0.0, 0.0][:d]},
        },
    }
    return prepare(read_tables(scene)).problem


def hooke(trace: float, twice_shear: float, d: int) -> np.ndarray:
    e = np.eye(d)
    twins = np.einsum("ik,jl->ijkl", e, e) + np.einsum("il,jk->ijkl", e, e)
    return np.asarray(trace * np.einsum("ij,kl->ijkl", e, e) + twice_shear / 2 * twins)


@pytest.mark.parametrize("material", [STEEL, RUBBER, SOLID], ids=["plane stress", "averaged", "space"])
def test_the_stiffness_of_cells_is_hookes(material: dict[str, Any]) -> None:
    problem = composed(material)
    e, nu = material["youngs_modulus"], material["poisson_ratio"]
    trace = e * nu / ((1 - nu**2) if material["model"] == "plane_stress" else (1 + nu) * (1 - 2 * nu))
    expected = hooke(trace, e / (1 + nu), problem.scales.dimension) / problem.scales.modulus
    found = stiffness_tensor(problem.bulk, np.array([5, 1], dtype=np.int32))
    for cell in found:
        assert cell == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())
