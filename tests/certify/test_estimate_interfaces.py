"""The estimated error of bodies that meet: none where both hold the solution, near the true one else, on both sides."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scenes import STEEL, Table

from hvi_fenicsx import Model, read_tables, solve

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from effectivity import rows, scenes


def uniform(between: Table, stress: list[list[float]], upper: tuple[float, float], degree: int) -> Model:
    """Two blocks on meshes that do not match, under a uniform stress; upper: where the upper one begins, its width."""
    normals = {"left": (-1, 0), "right": (1, 0), "bottom": (0, -1), "top": (0, 1)}
    sides = [f"lower.{s}" for s in ("left", "right", "bottom")] + [f"upper.{s}" for s in ("left", "right", "top")]
    loads = {s: [float(np.dot(row, normals[s.split(".")[1]])) for row in stress] for s in sides}
    low = {"shape": "rectangle", "size": [1.0, 0.5], "cells": [7, 4]}
    high = {"shape": "rectangle", "size": [upper[1], 0.4], "cells": [5, 3], "origin": [upper[0], 0.5]}
    return read_tables(
        {
            "domain": {"lower": low, "upper": high},
            "material": STEEL,
            "boundary": {s.replace(".", "_"): {"on": s, "traction": t} for s, t in loads.items()},
            "interface": {"seam": {"between": ["upper.bottom", "lower.top"], **between}},
            "solver": {"tolerance": 1e-11, "degree": degree},
        }
    )


@pytest.mark.parametrize(
    ("between", "stress"),
    [
        ({"contact": {"gap": 0.0}}, [[0.0, 0.0], [0.0, -1e6]]),
        ({"tied": True}, [[0.0, 1e6], [1e6, 0.0]]),
        ({"adhesion": {"law": "graph", "points": [[0, 0], [1e-6, 4e6]]}}, [[0.0, 0.0], [0.0, 1e6]]),
    ],
)
@pytest.mark.parametrize("degree", [1, 2])
def test_a_uniform_stress_has_no_error(between: Table, stress: list[list[float]], degree: int) -> None:
    found = solve(uniform(between, stress, (0.0, 1.0), degree))
    assert found.exit_code == 0
    assert found.estimate is not None
    assert found.estimate.discretisation < 1e-10 * found.estimate.energy_norm
    assert found.estimate.total < 1e-8 * found.estimate.energy_norm


def test_stiff_bonds_between_bodies_at_degree_two() -> None:
    between = {"cohesion": {"law": "graph", "points": [[0, 0], [1e-8, 4e6], [4e-5, 0]], "beta": 0.7}}
    table = uniform(between, [[0.0, 0.0], [0.0, 1e6]], (0.0, 1.0), 2).tables()
    lid = {"lid": {"on": "upper.top", "traction": [2e5, 1e6]}, "foot": {"on": "lower.bottom", "displacement": [0, 0]}}
    (row,) = rows(read_tables(table | {"boundary": lid}).with_solver(tolerance=1e-8), 1, 1)
    assert row.certified
    assert 0.75 < row.index < 1.3


@pytest.mark.long
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("name", ["single_lap", "two_cylinders"])
def test_the_estimate_is_near_the_error_of_demos(name: str, degree: int) -> None:
    for row in rows(scenes()[name].with_solver(degree=degree), 2):
        assert row.certified
        assert row.index == pytest.approx(1.0, abs=0.2)
