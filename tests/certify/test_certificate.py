"""The certificate takes nobody's word: each of its entries must see the one fault it is there for, and no other.

That it accepts what is stationary and refuses what is near is shown by enumeration (test_enumeration.py).
"""

from __future__ import annotations

import copy
import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from dolfinx import fem
from runs import process
from scenes import STEEL, P, Q, Table, displacement, far, model, quadratic_linear, solved, two_blocks

from hvi_fenicsx import Solution, dump_scene, prepare, read_tables, solve
from hvi_fenicsx.certify.certificate import Certificate, examine

Array = npt.NDArray[np.float64]
STRONG = quadratic_linear(3e6)
CELLS = 6
ENTRIES = ("equilibrium", "net_force", "penetration", "tension", "complementarity", "inclusion")


@pytest.fixture(scope="module")
def found() -> Solution:
    """A solution with slips on both branches, closed and lifted vertices."""
    return solved(model(CELLS, 6e6, Q, STRONG))


def certified(solution: Solution, u: Array) -> Certificate:
    """Of a displacement in m, shape (n, 2)."""
    function = fem.Function(solution.problem.space)
    function.x.array[:] = (u / solution.problem.scales.displacement).ravel()
    return examine(solution.problem, function, 1e-8).certificate


def vertex(solution: Solution, x: float, y: float) -> int:
    at = solution.problem.space.tabulate_dof_coordinates()[:, :2]
    return int(np.argmin(np.linalg.norm(at - [x, y], axis=1)))


def on_floor(solution: Solution, closed: bool) -> int:
    """A vertex of the floor's interior, in contact or not."""
    assert solution.examination is not None
    state = solution.examination.states[0]
    inside = (state.surface.points[:, 0] > 0.01) & (state.surface.points[:, 0] < 0.99)
    return int(state.surface.blocks[np.flatnonzero(inside & (state.contact == closed))[0]])


def pushed(solution: Solution, block: int, step: tuple[float, float]) -> Certificate:
    u = displacement(solution).copy()
    u[block] += step
    return certified(solution, u)


def test_the_reference_slip_of_a_spring_is_no_scale_of_the_certificate() -> None:
    """J is ½ k x², whatever slip is called typical: all entries stay, and so does what a false state is refused by."""
    entries = []
    for slip in (1e-12, 1e-6, 1e3):
        table = model(CELLS)
        law = {"law": "linear_spring", "stiffness": 1e12, "reference_slip": slip}
        table["boundary"]["floor"] = {"on": "bottom", "support": law}
        solution = solved(table)
        false = pushed(solution, vertex(solution, 0.5, 0.0), (0.0, 1e-12))
        entries.append([getattr(false, name) for name in ENTRIES])
        assert not false.passed
    np.testing.assert_allclose(entries, [entries[0]] * len(entries), rtol=1e-6)


def test_the_solution_passes_with_a_wide_margin(found: Solution) -> None:
    verdict = certified(found, displacement(found))
    assert verdict.passed
    assert all(getattr(verdict, entry) < 1e-12 for entry in ENTRIES)


def test_a_vertex_inside_that_is_moved_breaks_equilibrium(found: Solution) -> None:
    verdict = pushed(found, vertex(found, 0.5, 0.5), (0.0, 1e-10))
    assert verdict.equilibrium > 1e-6
    assert not verdict.passed


def test_a_vertex_pushed_into_the_floor_is_penetration_of_that_size(found: Solution) -> None:
    verdict = pushed(found, on_floor(found, True), (0.0, -1e-9))
    assert verdict.penetration == pytest.approx(1e-9 / np.max(np.abs(displacement(found))), rel=1e-6)


def test_a_floor_that_pulls_is_tension(found: Solution) -> None:
    """The lifted vertex is put down: what then holds it is a pull."""
    block = on_floor(found, False)
    u = displacement(found).copy()
    lifted = np.flatnonzero(u[:, 1] > 0)
    u[block, 1] = 0.0
    verdict = certified(found, u)
    assert block in lifted
    assert verdict.tension > 1e-3


def test_a_pressure_on_a_lifted_vertex_is_complementarity(found: Solution) -> None:
    verdict = pushed(found, on_floor(found, True), (0.0, 1e-8))
    assert verdict.complementarity > 1e-4
    assert verdict.penetration == 0.0


def test_a_slip_that_the_law_does_not_allow_is_inclusion(found: Solution) -> None:
    verdict = pushed(found, on_floor(found, True), (1e-9, 0.0))
    assert verdict.inclusion > 1e-5
    assert verdict.penetration == verdict.tension == 0.0


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_no_number_is_refused(found: Solution, value: float) -> None:
    assert not pushed(found, vertex(found, 0.5, 0.5), (value, 0.0)).passed


def test_it_judges_the_displacement_not_the_word_of_the_solver(found: Solution) -> None:
    """The solution of one law is refused under another."""
    other = prepare(read_tables(model(CELLS, 6e6, Q, quadratic_linear(2.9e6))))
    u = fem.Function(other.problem.space)
    u.x.array[:] = displacement(found).ravel() / other.problem.scales.displacement
    verdict = examine(other.problem, u, 1e-8).certificate
    assert not verdict.passed
    assert verdict.inclusion > 1e-3


def test_the_papers_smoothing_is_told_to_be_a_quarter_of_gamma1_off() -> None:
    """physics.md: at no slip S gives γ2/2 = 250 N/m² where the law gives 0; the first vertex off the wall has less."""
    found = solved(model(16, P, Q, quadratic_linear(1e3), smoothing="paper", epsilon_absolute=0.1))
    assert found.examination is not None
    assert found.exit_code == 0
    assert found.examination.certificate.inclusion < 1e-8
    error = found.examination.smoothing_error * found.problem.scales.stress
    assert 200 < error < 250
    assert found.examination.certificate.inclusion_true == pytest.approx(error / (1e-3 * P), rel=1e-6)


def test_smoothed_solutions_approach_the_exact_one(found: Solution) -> None:
    """Far from the kink the default smoothing is exact, near it the difference falls with ε."""
    differences = []
    for epsilon in (1e-1, 1e-2, 1e-3):
        smooth = solved(model(CELLS, 3e6, Q, quadratic_linear(1e6), smoothing="chks", epsilon=epsilon))
        exact = solved(model(CELLS, 3e6, Q, quadratic_linear(1e6)))
        assert smooth.exit_code == 0
        differences.append(far(displacement(smooth), displacement(exact)))
    assert differences[0] > 5 * differences[1] > 25 * differences[2]


def bearing(wall: Table) -> Solution:
    """A body pressed against a wall at its left, on a floor with friction."""
    table = copy.deepcopy(model(5, -3e6, Q, quadratic_linear(1e6)))
    table["boundary"]["wall"] = {"on": "left", **wall}
    return solve(read_tables(table))


def test_a_corner_of_two_contact_parts_is_certified() -> None:
    """Pressed on, a smooth wall is a support: the corner bears the wall's contact and the floor's friction at once."""
    supported, touching = bearing({"displacement": [0.0, "free"]}), bearing({"contact": {"gap": 0.0}})
    assert supported.exit_code == touching.exit_code == 0
    assert far(displacement(touching), displacement(supported)) < 1e-9


def _floor_and_back(friction: float) -> Table:
    """A block held at its right side; floor and back wall, which meet at an edge, resist by friction."""
    law = {"law": "tresca", "yield_traction": friction}
    return {
        "domain": {"shape": "box", "size": [1.0, 0.5, 0.5], "cells": [1, 1, 1]},
        "material": STEEL | {"model": "three_dimensional"},
        "boundary": {
            "held": {"on": "right", "displacement": [0.0, 0.0, 0.0]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": law},
            "wall": {"on": "back", "friction": law | {"yield_traction": 10 * friction}},
        },
        "body": {"force": [-3e4, 0.0, -3e5]},
    }


@pytest.mark.parametrize("friction", [2e2, 2e3])
def test_two_frictions_share_the_force_at_their_edge(friction: float) -> None:
    """Each may carry a part of the force along the edge; their sum, not each, must be what is needed."""
    assert solved(_floor_and_back(friction)).converged


@pytest.mark.long
def test_ranks_without_a_vertex_of_an_edge_divide_its_force_too(tmp_path: Path) -> None:
    """One cell on three ranks: some own no vertex of the edge, or none of Γc at all."""
    scene = tmp_path / "edge.toml"
    scene.write_text(dump_scene(read_tables(_floor_and_back(2e3))), encoding="utf-8")
    done = process("run", scene, "--out", tmp_path / "r", "--no-pictures", ranks=3)
    assert done.returncode == 0, done.stderr
    alone = solved(_floor_and_back(2e3))
    assert alone.examination is not None
    energy = json.loads((tmp_path / "r" / "summary.json").read_text(encoding="utf-8"))["energy"]
    assert energy == pytest.approx(alone.examination.energy * alone.problem.scales.energy, rel=1e-9)


def test_an_edge_whose_force_exceeds_both_frictions_is_not_certified() -> None:
    """The solution with a hundredth of the displacement taken off: more is needed than both laws can give."""
    found = solve(read_tables(_floor_and_back(2e3)))
    assert found.solve_result is not None
    u = found.solve_result.u
    u.x.array[:] *= 0.99
    assert examine(found.problem, u, 1e-8).certificate.inclusion > 1e-3


def test_the_last_digits_of_a_displacement_excuse_a_steep_law_and_no_more_do() -> None:
    """Of two bodies that stick in a narrow smoothing the slip is a difference of displacements, and has few digits."""
    table = two_blocks("rectangle", [1.0], [[5, 5], [4, 4]], "plane_stress", smoothing="quadratic", epsilon=1e-7)
    table["boundary"] |= {
        "press": {"on": "upper.top", "traction": [0.0, -1e6]},
        "push": {"on": "upper.left", "traction": [9e4, 0.0]},
    }
    table["interface"]["seam"]["friction"] = {"law": "tresca", "yield_traction": 1e5, "reference_slip": 1e-6}
    found = solved(table)
    assert found.exit_code == 0
    assert found.certificate is not None
    assert found.certificate.tolerance < found.certificate.inclusion <= (found.certificate.rounding or 0.0) < 1e-6
    u = displacement(found).copy()
    members = found.problem.bodies.members
    u[members == members[vertex(found, 0.7, 0.9)], 0] += 1e3 * np.finfo(float).eps * np.max(np.abs(u))
    again = certified(found, u)
    assert not again.passed
    assert again.inclusion > 100.0 * found.certificate.inclusion
