"""The estimated error of bodies that meet: none where both hold the solution, near the true one else, on both sides."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from scenes import STEEL, Table, two_blocks

from hvi_fenicsx import Model, Solution, read_tables, solve

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


PLANE = two_blocks("rectangle", [1.0], [[9, 4], [7, 3]], "plane_stress", tolerance=1e-10, degree=1)
SPACE = two_blocks("box", [1.0, 0.8], [[4, 3, 2], [3, 4, 2]], "three_dimensional", degree=1)


@pytest.mark.long
@pytest.mark.parametrize(("blocks", "requested", "reference"), [(PLANE, 0.15, 0.04), (SPACE, 0.3, 0.12)])
def test_an_accuracy_is_reached_by_refining_both_bodies(blocks: Table, requested: float, reference: float) -> None:
    """The distance of two energies is half the square of the error, but for what the finer one still lacks."""
    coarse, fine = (refined(blocks, accuracy) for accuracy in (requested, reference))
    assert coarse.examination is not None
    assert fine.examination is not None
    assert coarse.estimate is not None
    assert fine.estimate is not None
    apart = math.sqrt(2 * (coarse.examination.energy - fine.examination.energy))
    away = math.hypot(apart, fine.estimate.total)
    assert away < requested * coarse.estimate.energy_norm
    assert away == pytest.approx(coarse.estimate.total, rel=0.2)
    for name in ("lower", "upper"):
        assert len(fine.problem.domain.regions[name]) > 2 * len(coarse.problem.domain.regions[name])
    (before,), (after,) = coarse.problem.interfaces, fine.problem.interfaces
    assert len(after.first.nodes) > 1.5 * len(before.first.nodes)
    assert len(after.second.nodes) > 1.5 * len(before.second.nodes)


def refined(blocks: Table, accuracy: float) -> Solution:
    from mpi4py import MPI

    from hvi_fenicsx.accuracy.adaptive import AdaptiveSolver
    from hvi_fenicsx.accuracy.control import solve_to_goal
    from hvi_fenicsx.accuracy.goal import Goal
    from hvi_fenicsx.runtime.timing import Timer

    scene, lines = read_tables(blocks), list[str]()
    found = solve_to_goal(scene, MPI.COMM_WORLD, Goal(accuracy=accuracy), AdaptiveSolver(timer=Timer()), lines.append)
    assert found.why is None
    return found.solution
