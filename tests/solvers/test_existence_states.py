"""Held, metastable, escapes: what a run does where existence is in question, against statics by hand (physics.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from runs import hvi, summary, write_scene
from scenes import DELTA, STEEL, P, Q, Table, block, displacement, model, points, quadratic_linear, solved

from hvi_fenicsx import read_tables, solve, workflow
from hvi_fenicsx.solvers.thresholds import Thresholds as SolverThresholds
from hvi_fenicsx.system import boundedness
from hvi_fenicsx.workflow import Thresholds

GAMMA = 1.0e6
LAW = quadratic_linear(GAMMA)


def mean_slip(table: Table) -> float:
    """∫ u1 ds over the floor, by the trapezoidal rule, m."""
    found = solved(table)
    assert found.exit_code == 0
    x = points(found)
    on = np.flatnonzero(x[:, 1] == 0)
    on = on[np.argsort(x[on, 0])]
    return float(np.trapezoid(displacement(found)[on, 0], x[on, 0]))


@pytest.mark.parametrize("share", [0.1, 0.45, 0.55, 0.6])
def test_a_pushed_block_slips_as_far_as_its_friction_needs(share: float) -> None:
    """On the rising branch the floor gives ∫ γ1 u1/δ ds, which must be P: held below γ2 L, metastable above it."""
    table = block(6, -share * GAMMA, Q, LAW)
    assert mean_slip(table) == pytest.approx(-share * DELTA, rel=1e-9)
    found = solved(table)
    assert found.solvability.state == ("held" if share < 0.5 else "metastable")
    assert ("local equilibrium" in found.reason) == (share > 0.5)


@pytest.mark.parametrize(("share", "code"), [(0.499, 0), (0.501, 0), (1.001, 3), (2.0, 3)])
def test_a_push_beyond_the_peak_has_no_equilibrium(share: float, code: int) -> None:
    found = solved(block(4, share * GAMMA, 4 * Q, LAW))
    assert found.exit_code == code
    assert (found.solve_result is None) == (code == 3)


@pytest.mark.parametrize("push", [0.3e6, 0.8e6])
def test_the_load_factors_are_residual_and_peak_strength(push: float) -> None:
    found = solved(block(3, push, 4 * Q, LAW)).solvability
    assert found.lambda_held == pytest.approx(GAMMA / 2 / push, rel=1e-9)
    assert found.lambda_peak == pytest.approx(GAMMA / push, rel=1e-9)
    assert [mode.name for mode in found.kernel][:2] == ["translation along x", "translation along y"]
    assert len(found.kernel) == 3


def test_a_block_on_friction_alone_cannot_stand_upright() -> None:
    """Friction without contact bears no weight; without weight it stands, and what it does is borderline."""
    table = block(3, 0.2e6, Q, LAW)
    del table["boundary"]["floor"]["contact"]
    assert solved(table).exit_code == 3
    table["boundary"]["press"]["traction"] = [0.0, 0.0]
    table["boundary"]["pull"]["traction"] = [0.0, 0.0]
    still = solved(table)
    assert (still.exit_code, still.solvability.state) == (0, "borderline")


@pytest.mark.parametrize(
    ("table", "words", "motion"),
    [
        (model(4, press=-Q), "translation along y", (0.0, 1.0)),
        (block(4, 2.0 * GAMMA, 4 * Q, LAW), "translation along x", (1.0, 0.0)),
        (block(4, -2.0 * GAMMA, 4 * Q, LAW), "translation along x", (-1.0, 0.0)),
    ],
)
def test_an_escape_is_told_in_words_and_as_a_field(
    table: Table, words: str, motion: tuple[float, float], tmp_path: Path
) -> None:
    pyvista = pytest.importorskip("pyvista")
    done = hvi("run", write_scene(tmp_path / "s.toml", table), "--out", tmp_path / "r", "--no-pictures")
    assert done.returncode == 3
    assert words.removesuffix("x").removesuffix("y") in summary(tmp_path / "r")["solvability"]["direction"]
    mode = pyvista.get_reader(tmp_path / "r" / "displacement.pvd").read()[0]["escape_mode"]
    assert np.ptp(mode, axis=0) == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(mode[0, :2] / np.linalg.norm(mode[0]), motion, atol=1e-12)
    assert not (tmp_path / "r" / "contact.csv").exists()


def test_a_push_high_up_tips_the_block() -> None:
    """P at height 1/2 against Q at 1/2 from the edge: beyond P = Q the block turns about its front edge."""
    slipping = quadratic_linear(1e8)
    assert solved(block(4, 0.99 * Q, Q, slipping)).exit_code == 0
    found = solved(block(4, 1.01 * Q, Q, slipping))
    assert found.exit_code == 3
    assert found.solvability.direction is not None
    assert "rotation about (1, 0), clockwise" in found.solvability.direction.name


def test_the_margin_is_what_the_load_has_left() -> None:
    """Only y = e_y: the margin of the model problem is Q over the stress scale."""
    for press in (1e3, 1e6):
        assert solved(model(3, P, press)).solvability.margin == pytest.approx(press / P, rel=1e-9)


def test_in_space_too_a_support_does_not_show_in_the_friction() -> None:
    """Where a wall prescribes a component, the residual holds its reaction; the law's own traction stands there."""
    found = solve(
        read_tables(
            {
                "domain": {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [4, 4, 2]},
                "material": {"model": "three_dimensional", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
                "boundary": {
                    "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
                    "pull": {"on": "right", "traction": [1e6, 2e5, 0.0]},
                    "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
                    "floor": {
                        "on": "bottom",
                        "contact": {"gap": 0.0},
                        "friction": {"law": "quadratic_linear", "gamma1": 1e6, "gamma2": 5e5, "delta": 9e-6},
                    },
                },
            }
        )
    )
    assert found.converged
    assert found.examination is not None
    state, scales = found.examination.states[0], found.problem.scales
    held = state.surface.points[:, 0] < 1e-9
    wanted = 1e6 / 9e-6 * state.slip[held] * scales.displacement / scales.stress
    assert np.allclose(state.friction[held], wanted, rtol=1e-9, atol=1e-12)


def test_the_search_for_an_equilibrium_that_need_not_exist_ends() -> None:
    brief = Thresholds(solvers=SolverThresholds(search_steps=3))
    found = solved(block(3, 0.97 * GAMMA, Q, LAW), brief)
    assert found.solvability.state == "metastable"
    assert found.exit_code == 4
    assert "no equilibrium found in 3 Newton steps" in found.reason
    assert solved(block(3, 0.45 * GAMMA, Q, LAW), brief).converged  # held: no such limit


@pytest.mark.parametrize("gap", [-1e-3, "-1e-3*x", "-1e-3*(1 + x)"])
def test_an_obstacle_that_presses_a_free_body_up_moves_it_rigidly(gap: float | str) -> None:
    """No load at all: the least rigid motion that the obstacle demands, and no force beyond rounding."""
    table = model(6, gap=gap)
    table["boundary"] = {"floor": table["boundary"]["floor"]}
    found = solved(table)
    assert (found.exit_code, found.solvability.state) == (0, "borderline")
    x, u = points(found), displacement(found)
    wanted = {-1e-3: 1e-3 + 0 * x[:, 0], "-1e-3*x": 1e-3 * x[:, 0], "-1e-3*(1 + x)": 1e-3 * (1 + x[:, 0])}[gap]
    assert u[:, 1] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    turn = 0.0 if gap == -1e-3 else 1e-3
    assert u[:, 0] == pytest.approx(-turn * (x[:, 1] - 0.5), rel=1e-9, abs=1e-12)


def test_in_space_a_law_that_has_fallen_below_zero_resists_nothing() -> None:
    """ξ > H' everywhere: what is left of the law pushes the body on, and is no negative resistance to divide by."""
    law = {"law": "graph", "points": [[0, 4e5], [1e-6, -2e5], [1e-6, -8e5]]}
    table = {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [1, 1, 1]},
        "material": STEEL | {"model": "three_dimensional"},
        "boundary": {
            "wall": {"on": "right", "displacement": [0.0, "free", "free"]},
            "pull": {"on": "left", "traction": [5e5, 1e4, 0.0]},
            "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": law},
        },
    }
    prepared = workflow.prepare(read_tables(table))
    term = prepared.problem.terms[0]
    beyond = term.law.concave.left(np.full(len(term.surface.blocks), 10.0 * term.law.length_scale))
    assert np.all(beyond > term.law.convex.right(np.array([10.0 * term.law.length_scale])))
    assert boundedness.is_unbounded(prepared.problem, prepared.system.forces, [term.law], [beyond])
