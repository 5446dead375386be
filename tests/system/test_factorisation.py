"""Factors with averaged pressures as unknowns solve what those of the matrix itself solve, and count the same."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from factorisation_ranks import compared
from mpi4py import MPI
from runs import on_ranks
from scenes import quadratic_linear, two_blocks

RUBBER = {"youngs_modulus": 1e6, "poisson_ratio": 0.4999}
LAW = quadratic_linear(1e3)


def cube(cells: int = 2) -> dict[str, Any]:
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [cells] * 3},
        "material": RUBBER | {"model": "three_dimensional"},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
            "press": {"on": "top", "traction": [1e2, 0.0, -1e3]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": LAW},
        },
        "solver": {"degree": 2},
    }


def blocks() -> dict[str, Any]:
    """Two bodies, so two averages, whose unknowns an interface couples."""
    table = two_blocks("rectangle", [1.0], [[6, 3], [5, 2]], "plane_strain", degree=2)
    return table | {"material": RUBBER | {"model": "plane_strain"}}


def disk() -> dict[str, Any]:
    """Curved cells, and a normal of its own at each node of Γc."""
    return {
        "domain": {"shape": "half_disk", "radius": 0.1, "mesh_size": 0.02},
        "material": RUBBER | {"model": "plane_strain"},
        "boundary": {
            "press": {"on": "top", "traction": [0.0, -1e3]},
            "arc": {"on": "arc", "contact": {"gap": 0.0}, "friction": LAW},
        },
        "solver": {"degree": 2},
    }


@pytest.mark.parametrize("table", [cube(), blocks()], ids=["cube", "blocks"])
def test_solutions_and_negative_eigenvalues_are_those_of_the_matrix_itself(table: dict[str, Any]) -> None:
    told = compared(table, MPI.COMM_SELF)
    assert told["pressures"][0] > 0
    assert told["difference"] < 1e-7
    assert told["negative"][0] == told["negative"][1] > 0


@pytest.mark.long
def test_on_several_ranks_too() -> None:
    told = on_ranks(3, str(Path(__file__).parent / "factorisation_ranks.py"), json.dumps(cube(4)))
    assert min(told["pressures"]) > 0
    assert told["difference"] < 1e-7
    assert told["negative"][0] == told["negative"][1] > 0
