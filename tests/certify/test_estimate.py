"""The error estimate against errors that are known otherwise: closed forms, manufactured solutions, finer meshes.

An estimate that is a factor off still looks like one; so its index, estimated over true error, is held near 1, and
each part to what it claims to measure: the mesh, the smoothing, the solver.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from dolfinx import fem
from runs import hvi, summary, write_scene
from scenes import Table, block, model, quadratic_linear, solved, solved_system

from hvi_fenicsx import Solution, prepare, read_tables
from hvi_fenicsx.certify.certificate import examine
from hvi_fenicsx.estimate.estimator import Estimate, estimate, estimate_contact_errors
from hvi_fenicsx.problem.problem import Problem
from hvi_fenicsx.workflow import finish

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from effectivity import glued_plate, l_shape, rows, rubber, waves


def energy_norm(problem: Problem, u: fem.Function) -> float:
    """a(u, u)^½ where no dilatation is averaged."""
    force = problem.bulk.force(u).ravel()
    return float(np.sqrt(force @ u.x.array))


def estimated(solution: Solution) -> Estimate:
    assert solution.converged
    assert solution.estimate is not None
    return solution.estimate


# --- the mesh


def test_a_solution_that_p1_holds_has_no_error() -> None:
    found = estimated(solved(model(5)))
    assert found.total < 1e-12 * found.energy_norm
    assert found.smoothing == 0.0


@pytest.mark.parametrize(("cells", "kind"), [(8, "held"), (16, "held"), (16, "pressed")])
def test_manufactured_the_index_is_near_1(cells: int, kind: str) -> None:
    """U = (0, c y (1 + x - x²)) with its loads, c < 0: on a clamped bottom, or on a floor that it presses all along."""
    e, nu = 1.0e9, 0.3
    plane = e / (1 - nu**2)
    c, shear = -1e-3, e / (2 * (1 + nu))
    top = [f"{shear * c}*(1 - 2*x)", f"{plane * c}*(1 + x - x*x)"]
    right = [f"{plane * nu * c}*(1 + x - x*x)", f"{shear * c}*y*(1 - 2*x)"]
    force = [f"-({plane * nu * c} + {shear * c})*(1 - 2*x)", f"{2 * shear * c}*y"]
    floor: Table = {"displacement": [0.0, 0.0]} if kind == "held" else {"contact": {"gap": 0.0}}
    table = {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": {"model": "plane_stress", "youngs_modulus": e, "poisson_ratio": nu},
        "body": {"force": force},
        "boundary": {
            "top": {"on": "top", "traction": top},
            "right": {"on": "right", "traction": right},
            "left": {"on": "left", "displacement": [0.0, f"{c}*y"]},
            "floor": {"on": "bottom", **floor},
        },
    }
    solution = solved(table)
    exact = fem.Function(fem.functionspace(solution.problem.domain.mesh, ("Lagrange", 3, (2,))))
    exact.interpolate(lambda x: np.stack([0 * x[0], c * x[1] * (1 + x[0] - x[0] ** 2)]))
    assert solution.solve_result is not None
    away = exact / solution.problem.scales.displacement - solution.solve_result.u
    form = fem.form(solution.problem.bulk.between(away, away))
    true = float(np.sqrt(fem.assemble_scalar(form)))
    assert 0.9 < estimated(solution).total / true < 1.1


STRONG = quadratic_linear(1.0e6)
LIFTED = model(8, pull=6e6, friction=quadratic_linear(3.0e6))
DEEP_DROP: Table = {"law": "graph", "points": [[0, 0], [9e-6, 3e6], [9e-6, 2e5]]}
"""On 16 cells the unbroken start leaves it between 0.5 and 0.5625; its place in the limit is 0.45."""
CASES: dict[str, Table] = {
    "strong law": model(8, pull=3e6, friction=STRONG),
    "lift-off": LIFTED,
    "deep drop": model(16, pull=6e6, friction=DEEP_DROP),
    "free block": block(6, push=0.6e6, friction=STRONG),
    "l-shape": l_shape(),
    "bending of a coarse plate": glued_plate(),
    "nearly incompressible": rubber(),
    "hardly compressible": rubber() | {"material": rubber()["material"] | {"poisson_ratio": 0.4999}},
    "half-disk": {
        "domain": {"shape": "half_disk", "radius": 0.1, "mesh_size": 0.02, "mesh_size_below": 0.004},
        "material": {"model": "plane_strain", "youngs_modulus": 1.0e7, "poisson_ratio": 0.3},
        "boundary": {
            "top": {"on": "top", "displacement": [0.0, "free"], "traction": [0.0, -2.0e4]},
            "floor": {"on": "arc", "contact": {"obstacle": {"point": [0.0, 0.0], "normal": [0.0, 1.0]}}},
        },
    },
    "block in space": {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [3, 3, 3]},
        "material": {"model": "three_dimensional", "youngs_modulus": 3.0e10, "poisson_ratio": 0.2},
        "body": {"force": [0.0, 1.0e4, -2.5e4]},
        "boundary": {
            "wall": {
                "on": "left",
                "contact": {"lower": 0.0, "upper": 0.0},
                "friction": quadratic_linear(4.0e4, 1e-4),
            }
        },
    },
}


FAST = ("lift-off", "free block", "l-shape", "hardly compressible", "block in space")


@pytest.mark.parametrize("name", [n if n in FAST else pytest.param(n, marks=pytest.mark.long) for n in CASES])
def test_against_a_mesh_four_times_finer(name: str) -> None:
    (row,) = rows(read_tables(CASES[name]), levels=1)
    assert 0.75 < row.index < 1.3


UNSEEN: dict[str, Table] = {
    "gap": model(4, gap="2e-6*sin(25*x)"),
    "gap with crests between the vertices": model(4, gap="1e-6*cos(50*x)"),
    "traction": model(4),
    "displacement": model(4),
    "traction on flat cells": waves([2, 8], 25),
    "traction on tall cells": waves([4, 1], 45),
}
UNSEEN["traction"]["boundary"]["press"]["traction"] = [0.0, "-1e6*(1 + 5*cos(60*x))"]
UNSEEN["displacement"]["boundary"] = {
    "top": {"on": "top", "displacement": ["free", "-5e-6*(1 + sin(9*x))"]},
    "bottom": {"on": "bottom", "displacement": [0.0, 0.0]},
}


@pytest.mark.parametrize("name", UNSEEN)
def test_data_that_the_mesh_does_not_see(name: str) -> None:
    (row,) = rows(read_tables(UNSEEN[name]), levels=1, extra=4)
    assert 0.8 < row.index < 1.3


# --- its parts


@pytest.mark.parametrize("name", ["strong law", pytest.param("half-disk", marks=pytest.mark.long)])
def test_degree_two_against_a_mesh_four_times_finer(name: str) -> None:
    scene = read_tables(CASES[name]).with_solver(degree=2)
    (row,) = rows(scene, levels=1, extra=2 if scene.dimension == 2 else 1)
    assert 0.75 < row.index < 1.3


def held_by_a_bond(cells: list[int], stiffness: float, poisson_ratio: float = 0.3) -> Table:
    """A slab that is held by nothing but a bond, pulled askew."""
    bond = {"law": "graph", "points": [[0, 0], [2e6 / stiffness, 2e6], [4e-3, 0]]}
    d = len(cells)
    return {
        "domain": {"shape": "box" if d == 3 else "rectangle", "size": [1.0] * (d - 1) + [0.5], "cells": cells},
        "material": {
            "model": "three_dimensional" if d == 3 else "plane_strain",
            "youngs_modulus": 2.0e9,
            "poisson_ratio": poisson_ratio,
        },
        "boundary": {
            "lid": {"on": "top", "traction": [1.0e4, *[0.0] * (d - 2), 1.0e5]},
            "bond": {"on": "bottom", "cohesion": bond},
        },
    }


@pytest.mark.parametrize(
    ("cells", "stiffness"), [([4, 2], 1e13), pytest.param([3, 3, 2], 1e11, marks=pytest.mark.long)]
)
def test_bonds_that_are_stiff_beside_the_cells_at_degree_two(cells: list[int], stiffness: float) -> None:
    scene = read_tables(held_by_a_bond(cells, stiffness)).with_solver(degree=2)
    (row,) = rows(scene, levels=1, extra=5 - len(cells))
    assert 0.75 < row.index < 1.3


@pytest.mark.parametrize(("cells", "degree"), [([4, 2], 1), pytest.param([3, 3, 2], 2, marks=pytest.mark.long)])
def test_stiff_bonds_of_a_nearly_incompressible_slab(cells: list[int], degree: int) -> None:
    """The bond is nearly a clamp, of which the index is 1.06 in the plane against a mesh four times finer."""
    scene = read_tables(held_by_a_bond(cells, 1e13, 0.49)).with_solver(degree=degree)
    (row,) = rows(scene, levels=1, extra=4 - len(cells))
    assert 0.9 < row.index < 1.15


@pytest.mark.parametrize("strong", [False, True])
def test_smoothing_is_what_it_changes_of_the_solution(strong: bool) -> None:
    laws = quadratic_linear(1e6 if strong else 1e3)
    width: Table = {"smoothing": "quadratic", "epsilon": 0.1} if strong else {"smoothing": "paper", "epsilon": 5.0}
    pull = 3e6 if strong else 1e6
    exact, smoothed = (solved(model(16, pull=pull, friction=laws, **options)) for options in ({}, width))
    assert exact.solve_result is not None
    assert smoothed.solve_result is not None
    away = fem.Function(exact.problem.space)
    away.x.array[:] = exact.solve_result.u.x.array - smoothed.solve_result.u.x.array
    true = energy_norm(exact.problem, away)
    assert true > 0.0
    assert 0.5 < estimated(smoothed).smoothing / true < 2.0
    assert estimated(exact).smoothing == 0.0


def test_what_smoothing_changes_is_counted_once() -> None:
    """Nodes that are found with the bubbles, as at degree 2, would answer the unsmoothed law."""
    table = model(8, friction=quadratic_linear(1e3), smoothing="paper", epsilon=20.0, degree=2)
    (row,) = rows(read_tables(table), levels=1)
    assert row.estimate.smoothing > 0.5 * row.true
    assert 0.8 < row.index < 1.1


def test_algebraic_is_the_distance_from_the_discrete_solution() -> None:
    prepared = prepare(read_tables(model(8, pull=3e6, friction=STRONG)))
    problem, system = prepared.problem, prepared.system
    u = solved_system(prepared).result.u
    moved = fem.Function(problem.space)
    moved.interpolate(lambda x: np.stack([1e-6 * np.sin(3 * x[0]) * x[1], 1e-6 * x[0] * x[1] ** 2]))
    true = energy_norm(problem, moved)
    moved.x.array[:] += u.x.array
    assert estimate(system, (), moved, examine(problem, moved, 1e-8)).algebraic == pytest.approx(true, rel=1e-6)


@pytest.mark.parametrize("cells", [4, 16])
@pytest.mark.parametrize("name", ["strong", "weak"])
def test_slip_and_friction_against_a_mesh_far_finer(name: str, cells: int) -> None:
    """With a drop the slip's error comes from where the drop lies between two vertices, and feeds on itself."""
    law = quadratic_linear(1e6 if name == "strong" else 1e3)
    prepared = prepare(read_tables(model(cells, 3e6, friction=law)))
    coarse, fine = finish(prepared), solved(model(128, 3e6, friction=law))
    found = estimate_contact_errors(prepared.system, (), coarse.solve_result.u, coarse.examination)
    true = [apart(read(coarse), read(fine), power) for read, power in ((slips, 2), (frictions, 1))]
    assert found.slip == pytest.approx(true[0], rel=0.45)
    assert found.friction == pytest.approx(true[1], rel=0.45)


def test_slip_where_friction_holds_some_vertices_and_others_slide() -> None:
    """A slip that the estimated error turns round is held by the kink at zero: friction does not change its sign."""
    prepared = prepare(read_tables(guided(8)))
    coarse, fine = finish(prepared), solved(guided(64))
    found = estimate_contact_errors(prepared.system, (), coarse.solve_result.u, coarse.examination)
    true = apart(slips(coarse), slips(fine), 2)
    assert 0.8 * true < found.slip < 1.7 * true


def guided(cells: int) -> Table:
    """A block that is pushed along a guide and rubs on a floor, where it sticks in part."""
    table = model(cells, friction={"law": "tresca", "yield_traction": 2e5}, gap="4e-6*(x - 0.7)**2")
    table["domain"] |= {"size": [2.0, 1.0], "cells": [2 * cells, cells]}
    table["body"] = {"force": [2e5, -2e6]}
    del table["boundary"]["pull"], table["boundary"]["press"]
    return table


def slips(solution: Solution) -> npt.NDArray[np.float64]:
    (state,) = solution.examination.states
    return np.asarray(state.slip[np.argsort(state.surface.points[:, 0]), 0] * solution.problem.scales.displacement)


def frictions(solution: Solution) -> npt.NDArray[np.float64]:
    (state,) = solution.examination.states
    return np.asarray(state.friction[np.argsort(state.surface.points[:, 0]), 0] * solution.problem.scales.stress)


def apart(coarse: npt.NDArray[np.float64], fine: npt.NDArray[np.float64], power: int) -> float:
    """Relative distance of values at even vertices of a line from those of a finer one."""
    at = np.linspace(0.0, 1.0, len(fine))
    away = np.abs(np.interp(at, np.linspace(0.0, 1.0, len(coarse)), coarse) - fine)
    return float((np.trapezoid(away**power) / np.trapezoid(np.abs(fine) ** power)) ** (1 / power))


def test_cells_add_up_and_find_the_corner() -> None:
    solution = solved(CASES["l-shape"])
    found = estimated(solution)
    assert np.sum(found.cells**2) == pytest.approx(found.discretisation**2)
    mesh = solution.problem.domain.mesh
    worst = np.argmax(found.cells)
    corners = mesh.geometry.x[mesh.geometry.dofmap[worst]]
    assert np.min(np.linalg.norm(corners - [0.5, 0.5, 0.0], axis=1)) < 1e-9


# --- in a run


def test_a_run_says_it(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "scene.toml", LIFTED)
    done = hvi("run", scene, "--out", tmp_path / "r", "--no-pictures")
    assert done.returncode == 0, done.stderr
    assert "estimated error" in done.stdout
    record = summary(tmp_path / "r")["estimate"]
    assert record["total"] / record["energy_norm"] == pytest.approx(record["relative"])
