"""Held, metastable, escapes: what a run does where existence is in question, against statics by hand (physics.md)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from runs import hvi, summary, write_scene
from scenes import DELTA, Q, Table, block, displacement, model, points, quadratic_linear, solved

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


@pytest.mark.parametrize("gap", [-1e-3, "-1e-3*x", "-1e-3*(1 + x)"])
def test_an_obstacle_that_presses_a_free_body_up_moves_it_rigidly(gap: float | str) -> None:
    """No load at all: the least rigid motion that the obstacle demands, and no force beyond rounding."""
    table = model(6, gap=gap)
    table["boundary"] = {"floor": table["boundary"]["floor"]}
    found = solved(table)
    assert (found.exit_code, found.solvability.state) == (0, "borderline")
    assert found.solve_result.counts.newton <= 1, "the rounding of the travel is no force"
    x, u = points(found), displacement(found)
    wanted = {-1e-3: 1e-3 + 0 * x[:, 0], "-1e-3*x": 1e-3 * x[:, 0], "-1e-3*(1 + x)": 1e-3 * (1 + x[:, 0])}[gap]
    assert u[:, 1] == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    turn = 0.0 if gap == -1e-3 else 1e-3
    assert u[:, 0] == pytest.approx(-turn * (x[:, 1] - 0.5), rel=1e-9, abs=1e-12)
