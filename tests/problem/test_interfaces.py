"""Two bodies that meet: patch tests on meshes that do not match, balance of forces, limits of one body."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from dolfinx import fem
from joint_scenes import away_from_affine, differences_by_side, seam, seam_scene
from petsc4py import PETSc
from scenes import NESTED, Table, quadratic_linear

from hvi_fenicsx import InputError, Model, prepare, read_tables, solve
from hvi_fenicsx.certify import placed_forces
from hvi_fenicsx.problem.problem import Problem

Array = npt.NDArray[np.float64]
E, NU = 2.0e11, 0.3
MATERIAL = {"model": "plane_stress", "youngs_modulus": E, "poisson_ratio": NU}
CONTACT = {"contact": {"gap": 0.0}}


def rectangle(size: list[float], cells: list[int], origin: Any = (0.0, 0.0), angle: float = 0.0) -> Table:
    return {"shape": "rectangle", "size": size, "cells": cells, "origin": list(origin), "angle": angle}


def turned(angle: float, x: float, y: float) -> list[float]:
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    return [c * x - s * y, s * x + c * y]


def stacked(
    boundary: Table, between: Table, angle: float = 0.0, upper: tuple[float, float] = (0.0, 1.0), **solver: Any
) -> Model:
    """A block (0.9 high) on a block of width 1 and height 0.5, cut otherwise; upper: where it begins and its width."""
    low, high = rectangle([1.0, 0.5], [7, 4], angle=angle), rectangle([upper[1], 0.4], [5, 3], angle=angle)
    high["origin"] = turned(angle, upper[0], 0.5)
    return seam_scene(low, high, MATERIAL, boundary, between, **solver)


def pulled(angle: float, stress: Array) -> Table:
    """The tractions of a uniform stress (in the blocks' own axes) on all outer sides."""
    normals = {"left": (-1.0, 0.0), "right": (1.0, 0.0), "bottom": (0.0, -1.0), "top": (0.0, 1.0)}
    sides = ["lower.left", "lower.right", "lower.bottom", "upper.left", "upper.right", "upper.top"]
    forces = {side: stress @ np.array(normals[side.split(".")[1]]) for side in sides}
    return {s.replace(".", "_"): {"on": s, "traction": turned(angle, *map(float, t))} for s, t in forces.items()}


AT = pytest.mark.parametrize(("angle", "degree"), [(0.0, 1), (25.0, 1), (25.0, 2)])
BOTH = pytest.mark.parametrize("degree", [1, 2])


@AT
@pytest.mark.parametrize("between", [CONTACT, {"tied": True}])
def test_uniform_pressure_crosses_meshes_that_do_not_match(angle: float, degree: int, between: Table) -> None:
    found = solve(stacked(pulled(angle, np.diag([0.0, -1e6])), between, angle, degree=degree))
    assert found.exit_code == 0
    assert seam(found).pressure * found.problem.scales.stress == pytest.approx(-1e6, rel=1e-10)
    assert away_from_affine(found) < 1e-10


@AT
def test_the_second_side_has_the_traction_of_the_first(angle: float, degree: int) -> None:
    """Pressure and shear, as boundary.csv and contact.pvd have it."""
    found = solve(stacked(pulled(angle, np.array([[0.0, 1e6], [1e6, -2e6]])), {"tied": True}, angle, degree=degree))
    assert found.examination is not None
    assert away_from_affine(found) < 1e-10
    acting = placed_forces.second_tractions(found.problem, found.examination.states) * found.problem.scales.stress
    there = ~np.isnan(acting[:, 0])
    assert np.count_nonzero(there) == 7 * degree + 1
    assert acting[there] == pytest.approx(np.tile(turned(angle, 1e6, -2e6), (7 * degree + 1, 1)), rel=1e-10)


def held(angle: float, upper: tuple[float, float], degree: int = 1) -> Problem:
    base = {"base": {"on": "lower.bottom", "displacement": [0.0, 0.0]}}
    return prepare(stacked(base, CONTACT, angle, upper, degree=degree)).problem


@BOTH
@pytest.mark.parametrize("upper", [(0.0, 1.0), (0.23, 0.5), (-0.31, 1.7), (0.4, 1.1)])
def test_affine_fields_do_not_open_a_flat_seam(upper: tuple[float, float], degree: int) -> None:
    problem = held(25.0, upper, degree)
    x = problem.points[:, :2]
    for field in (np.ones_like(x), x @ np.array([[0.0, 1.0], [-1.0, 0.0]]), x @ np.array([[1.3, -0.2], [0.7, 2.1]])):
        opened = problem.relative(np.ascontiguousarray(field).ravel())
        assert np.abs(problem.surfaces[0].values(opened)).max() < 1e-13


@BOTH
@pytest.mark.parametrize(("between", "bodies"), [(CONTACT, 2), ({"tied": True}, 1)])
def test_rigid_motions_are_in_the_kernel(between: Table, bodies: int, degree: int) -> None:
    """Of each body by itself where contact is open, of both together where they are glued."""
    system = prepare(stacked(pulled(25.0, np.diag([0.0, -1e6])), between, 25.0, degree=degree)).system
    problem, matrix = system.problem, system.jacobian.matrix
    x, u = problem.points[:, :2], fem.Function(problem.space)
    members = problem.bodies.members if bodies == 2 else 0 * problem.bodies.members
    for body in range(bodies):
        for field in (0 * x + [1.0, 0.0], 0 * x + [0.0, 1.0], x @ np.array([[0.0, 1.0], [-1.0, 0.0]])):
            u.x.array[:] = np.where(members[:, None] == body, field, 0.0).ravel()
            motion = system.unknowns(u)
            forces = motion.duplicate()
            matrix.mult(motion, forces)
            size = forces.norm() / (matrix.norm(PETSc.NormType.INFINITY) * motion.norm())
            assert size < 1e-15


@BOTH
@pytest.mark.parametrize("upper", [(0.0, 1.0), (0.23, 0.5), (-0.31, 1.7), (0.4, 1.1)])
def test_a_uniform_pressure_has_force_and_moments_on_both_sides(upper: tuple[float, float], degree: int) -> None:
    """As many as the functions of the degree hold: exactly on both sides."""
    problem = held(0.0, upper, degree)
    surface = problem.surfaces[0]
    forces = np.zeros((len(problem.points), 2))
    forces[surface.blocks] = surface.weights[:, None] * surface.normals
    nodal = problem.on_bodies(forces)[:, 1] * problem.scales.length
    begin, end = max(upper[0], 0.0), min(sum(upper), 1.0)
    names = [body.name for body in problem.bodies.single()]
    for sign, name in ((-1.0, 'body "upper"'), (1.0, 'body "lower"')):
        mine = problem.bodies.members == names.index(name)
        moments = [nodal[mine] @ problem.points[mine, 0] ** k for k in range(degree + 1)]
        expected = [sign * (end ** (k + 1) - begin ** (k + 1)) / (k + 1) for k in range(degree + 1)]
        assert moments == pytest.approx(expected, abs=1e-13)


@BOTH
def test_what_is_prescribed_leaves_its_share_to_its_neighbour(degree: int) -> None:
    walls = {"wall": {"on": ["lower.left", "upper.left"], "displacement": [0.0, "free"]}}
    press = {"press": {"on": "upper.top", "traction": [0.0, -1e6]}}
    base = {"base": {"on": "lower.bottom", "displacement": ["free", 0.0]}}
    found = solve(stacked({**walls, **press, **base}, CONTACT, degree=degree))
    assert len(seam(found).surface.blocks) == 5 * degree
    assert seam(found).surface.weights.sum() * found.problem.scales.length == pytest.approx(1.0, rel=1e-14)
    assert seam(found).pressure * found.problem.scales.stress == pytest.approx(-1e6, rel=1e-10)
    assert away_from_affine(found) < 1e-10


def pushed(push: float, degree: int = 1, **between: Any) -> Model:
    boundary = {
        "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
        "press": {"on": "upper.top", "traction": [0.0, -1e6]},
        "push": {"on": "upper.left", "traction": [push, 0.0]},
    }
    return stacked(boundary, {**CONTACT, **between}, upper=(0.2, 0.6), degree=degree)


@BOTH
def test_both_sides_carry_opposite_forces(degree: int) -> None:
    found = solve(pushed(3e5, degree, friction=quadratic_linear(1e6, 1e-6)))
    assert found.forces is not None
    forces = found.forces.resultants(found.problem.domain.mesh.comm)
    unit = found.problem.scales.force
    assert forces["seam"] * unit == pytest.approx([-3e5 * 0.4, 1e6 * 0.6], rel=1e-10)
    assert forces["seam"] + forces[f"seam{placed_forces.SECOND}"] == pytest.approx([0.0, 0.0], abs=1e-12)


@BOTH
def test_a_block_slides_off_the_other_at_the_load_of_statics(degree: int) -> None:
    friction = {"law": "graph", "points": [[0, 0], [1e-6, 8e5], [1e-6, 5e5]]}
    factors = prepare(pushed(1e6, degree, friction=friction)).load_factors("push")
    assert factors.held == pytest.approx(5e5 * 0.6 / (1e6 * 0.4), rel=1e-9)
    assert factors.peak == pytest.approx(8e5 * 0.6 / (1e6 * 0.4), rel=1e-9)
    escaped = solve(pushed(1.3e6, degree, friction=friction))
    assert escaped.solvability.state == "escapes"
    assert escaped.solvability.direction is not None
    assert escaped.solvability.direction.name == 'translation along +x of body "upper": it slides off body "lower"'


@BOTH
def test_a_block_tips_over_on_the_other_at_the_load_of_statics(degree: int) -> None:
    stuck = {"law": "graph", "points": [[0, 0], [1e-6, 1e9]]}
    factors = prepare(pushed(1e6, degree, friction=stuck)).load_factors("push")
    assert factors.held == pytest.approx(1e6 * 0.6 * 0.3 / (1e6 * 0.4 * 0.2), rel=1e-9)
    assert factors.mode is not None
    assert factors.mode.name.startswith("rotation about (0.8, 0.5)")
    assert factors.mode.name.endswith('of body "upper": it comes off body "lower"')


def test_bodies_that_only_hold_each_other_separate_or_not() -> None:
    apart = {
        "down": {"on": "lower.bottom", "traction": [0.0, -1e6]},
        "up": {"on": "upper.top", "traction": [0.0, 1e6]},
    }
    bond = {"law": "graph", "points": [[0, 0], [1e-6, 4e6], [1e-5, 0]], "one_sided": True}
    friction = {"law": "graph", "points": [[0, 0], [1e-6, 4e5]]}
    found = solve(stacked(apart, {**CONTACT, "adhesion": bond, "friction": friction}))
    assert found.exit_code == 0
    assert found.solvability.state == "metastable"
    assert seam(found).gap * found.problem.scales.displacement == pytest.approx(0.25e-6, rel=1e-9)
    assert found.solvability.lambda_peak == pytest.approx(4.0, rel=1e-9)
    assert solve(stacked(apart, CONTACT)).solvability.state == "escapes"


@pytest.mark.parametrize("degree", [1, pytest.param(2, marks=pytest.mark.long)])
def test_multigrid_on_levels_with_their_own_seams_finds_the_same(degree: int) -> None:
    table = pushed(6e5, friction=quadratic_linear(1e6, 2e-6)).tables()
    table["domain"]["lower"]["cells"], table["domain"]["upper"]["cells"] = [32, 32], [48, 32]
    table["solver"] = {"tolerance": 1e-10, "degree": degree}
    scene = read_tables(table)
    levels, direct = solve(scene, thresholds=NESTED), solve(scene.with_solver(linear_solver="lu"))
    assert levels.solve_result is not None
    assert levels.solve_result.levels > 1
    assert levels.examination is not None
    assert direct.examination is not None
    assert levels.examination.energy == pytest.approx(direct.examination.energy, rel=1e-9)


def test_a_measured_gap_closes_before_it_carries() -> None:
    boundary = {
        "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
        "sink": {"on": "upper.top", "displacement": [0.0, -3e-6]},
    }
    table = stacked(boundary, {"contact": {"gap": "measured"}}).tables()
    table["domain"]["upper"]["origin"] = [0.0, 0.5 + 2e-6]
    found = solve(read_tables(table))
    strain = 1e-6 / 0.9
    pressure = -seam(found).pressure * found.problem.scales.stress
    assert found.exit_code == 0
    assert pressure.min() > 0.8 * E * strain
    table["boundary"]["sink"]["displacement"] = [0.0, -1.9e-6]
    apart = seam(solve(read_tables(table)))
    assert not apart.contact.any()


def test_three_blocks_in_a_row_pass_a_pressure_on() -> None:
    blocks = {
        "low": rectangle([1.0, 0.3], [9, 3]),
        "mid": rectangle([1.0, 0.3], [7, 2], [0.0, 0.3]),
        "top": rectangle([1.0, 0.3], [4, 2], [0.0, 0.6]),
    }
    found = solve(
        read_tables(
            {
                "domain": blocks,
                "material": MATERIAL,
                "boundary": {
                    "base": {"on": "low.bottom", "displacement": ["free", 0.0]},
                    "press": {"on": "top.top", "traction": [0.0, -1e6]},
                },
                "interface": {
                    "a": {"between": ["mid.bottom", "low.top"], **CONTACT},
                    "b": {"between": ["mid.top", "top.bottom"], **CONTACT},
                },
            }
        )
    )
    assert found.exit_code == 0
    assert len(found.solvability.free) == 3
    assert found.examination is not None
    for state in found.examination.states:
        assert state.pressure * found.problem.scales.stress == pytest.approx(-1e6, rel=1e-9)


def changed(path: str, value: Any) -> Table:
    table = pushed(3e5).tables()
    *keys, last = path.split(".")
    place = table
    for key in keys:
        place = place.setdefault(key, {})
    place[last] = value
    return table


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ("interface.seam.between", ["upper.bottom", "lower.bottom"], "do not face each other"),
        ("interface.seam.between", ["upper.bottom", "upper.bottom"], "one side twice"),
        ("interface.seam.between", ["upper.bottom", "middle.top"], 'unknown side "middle.top"'),
        ("interface.seam.between", ["upper.bottom"], "2 entries"),
        ("interface.seam.tied", True, "leave out contact"),
        ("interface.other", {"between": ["lower.top", "upper.bottom"], "tied": True}, "already; give that one"),
        ("interface.push", {"between": ["lower.left", "upper.bottom"], "tied": True}, "has this name already"),
        ("interface.seam.traction", [0.0, 1.0], 'unknown key "traction"'),
        ("interface.seam.contact", {"obstacle": {"point": [0, 0], "normal": [0, 1]}}, "no body"),
        ("boundary.press.contact", {"gap": "measured"}, "needs two bodies"),
        ("domain.upper.origin", [0.2, 0.3], 'it overlaps the body "upper"; move one of them'),
        ("domain.upper.origin", [0.2, 0.48], "inside of the body"),
        ("domain.third", rectangle([0.4, 0.4], [3, 3], [0.5, 0.6]), 'domain.upper: at .* it overlaps the body "third"'),
        ("domain.upper.origin", [1.2, 0.5], "do not face each other"),
        ("domain.upper.origin", [0.2, 0.5, 0.0], "wants 2"),
        ("domain.upper.shape", "sphere", "unknown shape"),
        ("domain.up-per", rectangle([1.0, 1.0], [2, 2], [5.0, 5.0]), "name of a body"),
        ("boundary.base.on", ["lower.bottom", "upper.bottom"], "free to carry"),
        ("material.region", "middle", 'unknown region "middle"'),
    ],
)
def test_what_does_not_fit_is_refused_with_the_mend(path: str, value: Any, words: str) -> None:
    with pytest.raises((InputError, ValueError), match=words):
        prepare(read_tables(changed(path, value)))


def covering() -> Model:
    """Blocks that cover each other, pressed askew and pushed."""
    boundary = {
        "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
        "press": {"on": "upper.top", "traction": [0.0, "-1e6*(2.4 - 2.6*x)"]},
        "push": {"on": "upper.left", "traction": [4e5, 0.0]},
    }
    return stacked(boundary, {**CONTACT, "friction": quadratic_linear(1e6, 1e-6)})


@pytest.mark.long
def test_exchanging_the_sides_changes_less_with_each_mesh() -> None:
    """Energies, so at least the second order in the mesh width."""
    differences = differences_by_side(covering().tables(), (2, 4, 8))
    assert np.all(differences[:-1] / differences[1:] > 4.0)
    assert differences[-1] < 1e-5
