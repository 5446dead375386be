"""A part that ends within a facet: on the mesh it ends elsewhere, and the estimate sees what that costs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from dolfinx import fem, geometry
from runs import hvi, summary, write_scene
from scenes import Table

from hvi_fenicsx import read_tables, solve
from hvi_fenicsx.api.solution import ModelSolution

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
    return solve(read_tables(table))


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


@pytest.mark.parametrize(("cells", "degree"), [(4, 1), (8, 2)])
def test_the_estimate_is_near_the_error(cells: int, degree: int) -> None:
    """|||u - u_h|||² = a(u, u) + a(u_h, u_h) - 2 <g, u_h> with the scene's own load g, from a mesh that it fits."""
    exact, found = solved(square(40, 2)), solved(square(cells, degree))
    error = np.sqrt(-2.0 * (exact.energy + found.energy + work(found, degree)))
    assert found.estimate is not None
    estimated = found.estimate.total * np.sqrt(found.problem.scales.energy)
    assert 0.8 < estimated / error < 1.2


LEFT: Table = {"on": "left", "displacement": [0.0, "free"]}
ROLLER: Table = {"on": "bottom", "displacement": ["free", 0.0]}
PRESS: Table = {"on": "top", "traction": [0.0, -LOAD]}
PULL: Table = {"on": "right", "traction": [2.0 * LOAD, 0.0]}
PARTS: dict[str, tuple[Table, Table]] = {
    "support": ({"on": "bottom", "displacement": [0.0, 0.0]}, {"press": {"on": "top", "traction": [3e5, -LOAD]}}),
    "contact": ({"on": "bottom", "contact": {"gap": 0.0}}, {"press": PRESS, "left": LEFT}),
    "friction": (
        {"on": "bottom", "friction": {"law": "tresca", "yield_traction": 0.5 * LOAD}},
        {"floor": ROLLER, "pull": PULL, "left": LEFT},
    ),
    "spring": (
        {"on": "bottom", "friction": {"law": "linear_spring", "stiffness": 1e10}},
        {"floor": ROLLER, "pull": PULL},
    ),
    "force": ({"on": "top", "force": [0.0, -LOAD]}, {"base": {"on": "bottom", "displacement": [0.0, 0.0]}}),
    "moment": ({"on": "top", "moment": LOAD}, {"base": {"on": "bottom", "displacement": [0.0, 0.0]}}),
}
"""The part that ends, and the others."""


def piece(kind: str, end: float, cells: int, degree: int) -> Table:
    """A square on which one part is where x is smaller than its end."""
    part, others = PARTS[kind]
    return {**square(cells, degree), "boundary": {**others, "part": {**part, "where": f"x < {end}"}}}


def difference(coarse: ModelSolution, fine: ModelSolution) -> float:
    """|||u_h - u||| of solutions on nested meshes, J^½ (J/m in 2D)."""
    space, mesh = fine.u.function_space, coarse.u.function_space.mesh
    x = space.tabulate_dof_coordinates()
    tree = geometry.bb_tree(mesh, mesh.topology.dim)
    near = geometry.compute_colliding_cells(mesh, geometry.compute_collisions_points(tree, x), x)
    values = coarse.u.eval(x, np.array([near.links(i)[0] for i in range(len(x))], dtype=np.int32))
    between = fem.Function(space)
    between.x.array[:] = (values.ravel() - fine.u.x.array) / fine.problem.scales.displacement
    return float(np.sqrt(fine.problem.bulk.energy_by_cell(between).sum() * fine.problem.scales.energy))


def index(coarse: Table, fine: Table) -> float:
    """Estimated over true error."""
    found = solved(coarse)
    assert found.estimate is not None
    return found.estimate.total * float(np.sqrt(found.problem.scales.energy)) / difference(found, solved(fine))


@pytest.mark.parametrize("kind", PARTS)
def test_the_estimate_is_near_the_error_of_any_part(kind: str) -> None:
    """On 8 x 8 cells the part ends at 0.25."""
    assert 0.7 < index(piece(kind, END, 8, 2), piece(kind, END, 40, 2)) < 1.4


@pytest.mark.long
def test_the_accuracy_that_was_asked_for_is_that_of_the_scene(tmp_path: Path) -> None:
    """The first mesh loads a twentieth of the side too much; its energy is 7 % too large."""
    exact = solved(square(40, 2)).energy
    table = square(4, 2)
    del table["solver"]
    done = hvi("run", write_scene(tmp_path / "scene.toml", table), "--accuracy", "0.05", "--out", tmp_path / "r")
    assert done.returncode == 0
    assert summary(tmp_path / "r")["energy"] == pytest.approx(exact, rel=0.01)
