"""A balanced load on motions that nothing holds: singular, and solved all the same, up to what is free.

The reference is a manufactured uniform stress, which P1 reproduces, less its share of the free motions in L².
Run as a script under mpirun this file prints what `solve_cases` returns.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from mpi4py import MPI
from runs import LONG_RANKS, hvi, on_ranks, summary, write_scene
from scenes import NU, E, P, Q, Table

from hvi_fenicsx import Solution, read_tables, solve

Array = npt.NDArray[np.float64]
SIDES = {"left": (0, -1), "right": (0, 1), "bottom": (-1, -1), "top": (-1, 1), "front": (1, -1), "back": (1, 1)}


def body(dimension: int, cells: int, linear_solver: str = "auto") -> Table:
    """A 2 x 1 (x 1) block that nothing holds and nothing loads."""
    size = [2.0, 1.0, 1.0][:dimension]
    return {
        "domain": {
            "shape": "rectangle" if dimension == 2 else "box",
            "size": size,
            "cells": [int(cells * s) for s in size],
        },
        "material": {
            "model": "plane_stress" if dimension == 2 else "three_dimensional",
            "youngs_modulus": E,
            "poisson_ratio": NU,
        },
        "boundary": {},
        "solver": {"linear_solver": linear_solver, "tolerance": 1e-10},
    }


def stressed(dimension: int, cells: int, stress: Array, linear_solver: str = "auto") -> Table:
    """The block under the tractions of a uniform stress on all its sides."""
    table = body(dimension, cells, linear_solver)
    for side, (axis, sign) in SIDES.items():
        if dimension == 3 or side not in ("front", "back"):
            traction = (sign * stress[:, axis % dimension]).tolist()
            table["boundary"][side] = {"on": [side], "traction": traction}
    return table


def strain(stress: Array) -> Array:
    """Hooke's law, of plane stress in the plane."""
    return np.asarray(((1 + NU) * stress - NU * np.trace(stress) * np.eye(len(stress))) / E)


def least(strain: Array) -> Array:
    """The gradient with this symmetric part whose field about the middle of the block is orthogonal to its rotations.

    With the moments M_i = ∫ x_i² dx, proportional to the squared sides: G_ij M_j = G_ji M_i.
    """
    moments = np.array([4.0, 1.0, 1.0])[: len(strain)]
    column, row = np.meshgrid(moments, moments)
    return np.asarray(strain * (1.0 + (row - column) / (row + column)))


def error(solution: Solution, gradient: Array, still: Array) -> float:
    """Largest difference from x ↦ gradient (x - still), relative. Collective."""
    d, comm = solution.scene.dimension, solution.problem.domain.mesh.comm
    assert solution.solve_result is not None
    u = solution.solve_result.u.x.array.reshape(-1, d) * solution.problem.scales.displacement
    x = solution.problem.space.tabulate_dof_coordinates()[:, :d] - still
    wanted = x @ gradient.T
    parts = comm.allgather((np.abs(u - wanted).max(initial=0.0), np.abs(wanted).max(initial=0.0)))
    return float(max(p[0] for p in parts) / max(p[1] for p in parts))


PLANE = np.array([[P, 0.3 * P], [0.3 * P, -Q / 2]])
SPACE = np.array([[P, 0.2 * P, 0.0], [0.2 * P, -Q / 2, 0.1 * P], [0.0, 0.1 * P, 0.4 * P]])
UNIAXIAL = np.array([[P, 0.0], [0.0, 0.0]])


def slot(cells: int) -> Table:
    """Pulled from a wall that it may slide along, by nothing that pushes it up or down."""
    table = body(2, cells)
    table["boundary"] = {
        "wall": {"on": ["left"], "contact": {"lower": 0.0, "upper": 0.0}},
        "pull": {"on": ["right"], "traction": [P, 0.0]},
    }
    return table


def ice(cells: int) -> Table:
    """Pressed on a floor without friction."""
    table = body(2, cells)
    table["boundary"] = {
        "floor": {"on": ["bottom"], "contact": {"gap": 0.0}},
        "press": {"on": ["top"], "traction": [0.0, -Q]},
    }
    return table


CASES: dict[str, tuple[Table, Array, int]] = {
    "plane": (stressed(2, 6, PLANE), least(strain(PLANE)), 3),
    "plane-gamg": (stressed(2, 10, PLANE, "gamg"), least(strain(PLANE)), 3),
    "space": (stressed(3, 2, SPACE), least(strain(SPACE)), 6),
    "space-gamg": (stressed(3, 4, SPACE, "gamg"), least(strain(SPACE)), 6),
    "slot": (slot(6), strain(UNIAXIAL), 1),
    "ice": (ice(6), strain(np.diag([0.0, -Q])), 1),
}
"""Scene, gradient of its displacement, free motions."""
STILL = {"slot": [0.0, 0.5], "ice": [1.0, 0.0]}
"""The point that stays where it is; elsewhere the middle."""


def solve_cases(comm: MPI.Comm) -> dict[str, Any]:
    """By case: state, exit code, number of free motions, error."""
    found = {}
    for name, (table, gradient, _) in CASES.items():
        solution = solve(read_tables(table), comm)
        still = np.array(STILL.get(name, [1.0, 0.5, 0.5][: len(gradient)]))
        wrong = error(solution, gradient, still)
        verdict = solution.solvability
        found[name] = [verdict.state, solution.exit_code, len(verdict.free), wrong]
    return found


@pytest.fixture(scope="module", params=LONG_RANKS)
def answers(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What `solve_cases` returns on one, two and three ranks."""
    found: dict[str, Any] = solve_cases(MPI.COMM_SELF) if request.param == 1 else on_ranks(request.param, __file__)
    return found


@pytest.mark.parametrize("name", CASES)
def test_a_free_body_in_balance_is_solved_up_to_its_motions(name: str, answers: dict[str, Any]) -> None:
    state, code, free, wrong = answers[name]
    assert (state, code, free) == ("borderline", 0, CASES[name][2])
    assert wrong < (1e-7 if name.endswith("gamg") else 1e-11)


@pytest.mark.parametrize("method", ["auto", "branch", "snes_vi", "condensed"])
def test_contact_that_opens_leaves_a_motion_free(method: str) -> None:
    """Pushed unevenly against a wall that opens at its top, so that contact is iterated on; nothing holds y."""
    table = slot(6)
    table["boundary"] = {
        "wall": {"on": ["left"], "contact": {"gap": 0.0}},
        "push": {"on": ["right"], "traction": ["-1e6 + 2.4e6*(y - 0.5)", 0.0]},
    }
    table["solver"] = {"method": method}
    solution = solve(read_tables(table))
    assert (solution.exit_code, solution.solvability.state) == (0, "borderline")
    assert [mode.name for mode in solution.solvability.free] == ["translation along y"]
    assert solution.examination is not None
    (state,) = solution.examination.states
    assert 0 < np.count_nonzero(state.contact) < len(state.contact)
    assert _mean(solution, 1) == pytest.approx(0.0, abs=1e-10)
    pressure = float(state.surface.weights @ state.contact_pressure) * solution.problem.scales.length
    assert pressure * solution.problem.scales.stress == pytest.approx(-P, rel=1e-8)


def _mean(solution: Solution, component: int) -> float:
    """∫ u_i dx, nondimensional, by the corners of the cells."""
    assert solution.solve_result is not None
    mesh, u = solution.problem.domain.mesh, solution.solve_result.u.x.array.reshape(-1, 2)[:, component]
    cells = solution.problem.space.dofmap.list
    x = mesh.geometry.x[mesh.geometry.dofmap][:, :, :2]
    sides = x[:, 1:] - x[:, :1]
    return float(np.sum(np.abs(np.linalg.det(sides)) / 2 * u[cells].mean(axis=1)))


def test_what_stays_free_is_told(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "s.toml", slot(4))
    done = hvi("run", scene, "--out", tmp_path / "r", "--no-pictures")
    assert done.returncode == 0
    assert "undetermined, neither held nor driven: translation along y" in done.stdout
    found = summary(tmp_path / "r")
    assert found["solvability"]["free"] == ["translation along y"]
    assert found["solvability"]["state"] == "borderline"
    assert found["reason"] == "certified; determined up to translation along y"


if __name__ == "__main__":
    answered = solve_cases(MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(answered))
