"""A load whose part ends within a facet: the mesh loads another part, and the estimate sees by how much."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from runs import hvi, summary, write_scene
from scenes import Table

from hvi_fenicsx import Scene, solve
from hvi_fenicsx.modelling.solution import ModelSolution

LOAD, END = 1e6, 0.3


def square(cells: int, degree: int, **load: object) -> Table:
    """A square on a fixed base, pressed on its top from x = 0.3 on."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": {"model": "plane_strain", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
        "boundary": {
            "base": {"on": "bottom", "displacement": [0.0, 0.0]},
            "load": {"on": "top", "where": f"x > {END}", **(load or {"traction": [0.0, -LOAD]})},
        },
        "solver": {"degree": degree},
    }


def solved(table: Table) -> ModelSolution:
    return solve(Scene.model_validate(table))


def work(found: ModelSolution, degree: int) -> float:
    """∫ of the load over its own part times the displacement there, exact for its polynomials, J/m."""
    x = found.u.function_space.tabulate_dof_coordinates()
    top = np.flatnonzero(x[:, 1] > 1.0 - 1e-9)
    top = top[np.argsort(x[top, 0])]
    places, values = x[top, 0], found.u.x.array.reshape(-1, 2)[top, 1]
    done = 0.0
    for i in range(0, len(top) - degree, degree):
        primitive = np.polyint(np.polyfit(places[i : i + degree + 1], values[i : i + degree + 1], degree))
        ends = np.maximum(places[[i, i + degree]], END)
        done += float(np.diff(np.polyval(primitive, ends))[0])
    return -LOAD * done


@pytest.mark.parametrize(("cells", "degree"), [(4, 1), (8, 1), (4, 2), (8, 2)])
def test_the_estimate_is_near_the_error(cells: int, degree: int) -> None:
    """|||u - u_h|||² = a(u, u) + a(u_h, u_h) - 2 <g, u_h> with the scene's own load g, from a mesh that it fits."""
    exact, found = solved(square(40, 2)), solved(square(cells, degree))
    error = np.sqrt(-2.0 * (exact.energy + found.energy + work(found, degree)))
    assert found.estimate is not None
    estimated = found.estimate.total * np.sqrt(found.problem.scales.energy)
    assert 0.8 < estimated / error < 1.2


def test_a_pressure_counts_as_the_traction_that_it_is() -> None:
    estimates = [solved(square(4, 2, **load)).estimate for load in ({}, {"pressure": LOAD})]
    assert estimates[0] is not None
    assert estimates[1] is not None
    assert estimates[1].total == pytest.approx(estimates[0].total, rel=1e-6)


@pytest.mark.long
def test_the_accuracy_that_was_asked_for_is_that_of_the_scene(tmp_path: Path) -> None:
    """The first mesh loads a twentieth of the side too much; its energy is 7 % too large."""
    exact = solved(square(40, 2)).energy
    table = square(4, 2)
    del table["solver"]
    done = hvi("run", write_scene(tmp_path / "scene.toml", table), "--accuracy", "0.05", "--out", tmp_path / "r")
    assert done.returncode == 0
    assert summary(tmp_path / "r")["energy"] == pytest.approx(exact, rel=0.01)
