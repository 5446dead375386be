"""Warnings on suspicious scenes: each where a unit was taken for another, none where a scene means what it says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from runs import ROOT, hvi, summary, write_scene
from scenes import block, model, quadratic_linear

from hvi_fenicsx import console, prepare, read_scene, read_tables, solve

LAW = quadratic_linear(1.0e6)
COARSE = ("domain.cells=[8, 8]",)


def warned(table: dict[str, Any]) -> tuple[str, ...]:
    return solve(read_tables(table)).warnings


def material(table: dict[str, Any], **changes: float) -> dict[str, Any]:
    table["material"] |= changes
    return table


def sized(metres: float) -> dict[str, Any]:
    table = model(8)
    table["domain"]["size"] = [metres, metres]
    return table


MISTAKEN = {
    "E in GPa": (lambda: material(model(), youngs_modulus=215.0), "Young's modulus is 215"),
    "E in Pa twice": (lambda: material(model(), youngs_modulus=2.15e17), "Young's modulus is 2.15e+17"),
    "E in MPa": (lambda: material(model(), youngs_modulus=2.15e5), "is 4.65 of Young's modulus"),
    "a body in mm": (lambda: sized(1000.0), "the body is 1000 m long"),
    "a law in MPa": (lambda: model(friction=quadratic_linear(1.0)), "friction: the law can carry 1 N/m at most"),
    "delta in µm": (lambda: model(friction=quadratic_linear(1e6, delta=9.0)), "on its first piece everywhere"),
    "delta off by 1e6": (
        lambda: model(8, friction=quadratic_linear(1e5, delta=9e-13)),
        "far beyond it nearly everywhere",
    ),
    "a law of the wrong sign": (
        lambda: model(friction={"law": "graph", "points": [[0, 0], [1e-5, 1e6], [2e-5, -1e6]]}),
        "falls to -1e+06 N/m² at a displacement",
    ),
    "a load in MPa": (lambda: block(2, 1.0, friction=LAW), "the load may be multiplied by 1.0e+06 at most"),
    "a wide smoothing": (
        lambda: model(8, 6e6, friction=LAW, smoothing="quadratic", epsilon_absolute=1e3),
        "smoothing changes the traction",
    ),
}
HUNG = {"on": "top", "displacement": ["free", 0.0]}


@pytest.mark.parametrize("case", MISTAKEN)
def test_a_unit_taken_for_another_is_told(case: str) -> None:
    make_table, words = MISTAKEN[case]
    found = warned(make_table())
    assert any(words in sentence for sentence in found), found


def test_a_gap_that_never_closes_is_told() -> None:
    table = model(gap=3.0)
    table["boundary"]["press"] = HUNG
    assert any("the gap is 3 m at least" in sentence for sentence in warned(table))


def on_floor(law: dict[str, Any], traction: str) -> tuple[str, ...]:
    """What is warned of a block on a law alone, under a traction upwards."""
    table = block(2, 0.0)
    table["boundary"]["press"]["traction"] = [0.0, traction]
    table["boundary"]["push"] = {"on": "left", "displacement": [0.0, "free"]}
    table["boundary"]["floor"] = {"on": "bottom", **law}
    return tuple(s for s in warned(table) if "the side " in s)


SPRING = {"law": "linear_spring", "stiffness": 1e12}
RISING = {"law": "graph", "points": [[0, 0], [1.0, 1e12]]}


@pytest.mark.parametrize("key", ["cohesion", "adhesion"])
def test_bonds_that_are_pressed_are_told(key: str) -> None:
    """Under an even traction every vertex of the floor goes up, or down, with it."""
    side = {"on": "left", "displacement": [0.0, "free"]}
    top = {"on": "top", "displacement": ["free", -1e-6]}
    for pressed, push in (True, -1e-6), (False, 1e-6):
        table = block(2, 0.0)
        table["boundary"] = {"push": side, "press": top | {"displacement": ["free", push]}}
        table["boundary"]["floor"] = {"on": "bottom", key: RISING}
        assert any("nothing stops penetration" in s for s in warned(table)) == pressed


def test_a_foundation_that_pulls_is_told() -> None:
    """A block that is drawn upwards at one end only lifts off there; pressed evenly it lifts off nowhere."""
    assert "is pulled back" in on_floor({"support": SPRING}, "1e6*(2*x - 1)")[0]
    assert not on_floor({"support": SPRING}, "-1e6")


@pytest.mark.parametrize("strain", [0.09, 0.11])
def test_a_strain_is_told_by_its_size(strain: float) -> None:
    """Uniaxial: strain = traction over modulus."""
    table = material(model(pull=strain * 1e7, press=0.0), youngs_modulus=1e7, poisson_ratio=0.0)
    table["boundary"]["press"] = HUNG
    said = [s for s in warned(table) if "strain" in s]
    assert len(said) == (2 if strain > 0.1 else 0)
    assert all(f"{strain:.3g}" in s for s in said)


def test_a_coarse_mesh_is_told_with_its_error() -> None:
    scene = read_scene(ROOT / "demos" / "tipping_tower.toml", COARSE)
    solution = solve(scene)
    (warning,) = solution.warnings
    assert solution.estimate is not None
    assert solution.estimate.discretisation > 0.1 * solution.estimate.energy_norm
    assert f"error is {100 * solution.estimate.discretisation / solution.estimate.energy_norm:.2g} %" in warning
    assert warning.endswith("refine the mesh")  # a program from Python has no --accuracy
    assert [line for line in console.outcome(solution) if "`hvi run SCENE --accuracy 0.05`" in line]


@pytest.mark.parametrize("demo", sorted((ROOT / "demos").glob("*.toml")), ids=lambda d: d.stem)
def test_before_solving_only_the_implausible_demos_are_warned_of(demo: Path) -> None:
    """The paper's law carries a thousandth of the load; the other scene is dimensionless, with a modulus of 10."""
    expected = {
        "wall_left": "it cannot matter",
        "wall_right": "it cannot matter",
        "jureczka_ochal": "Young's modulus is 10 N/m²",
    }
    found = prepare(read_scene(demo)).warnings
    if demo.stem in expected:
        assert any(expected[demo.stem] in sentence for sentence in found)
    else:
        assert found == ()


def test_the_papers_own_data_are_warned_of_twice() -> None:
    law, smoothing = solve(read_scene(ROOT / "demos" / "wall_left.toml")).warnings
    assert "5.0e-04 of the load" in law
    assert "24 % of the law's peak" in smoothing


def test_a_weak_law_that_alone_holds_the_body_does_matter() -> None:
    """Without the wall the floor's friction, a thousandth of the press, is all that keeps the block in its place."""
    assert warned(block(push=100.0, press=1e6, friction=quadratic_linear(1e3))) == ()


def test_it_is_said_everywhere(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", material(model(), youngs_modulus=2.15e5))
    done = hvi("run", path, "--out", tmp_path / "r", "--no-pictures")
    said = [line.removeprefix("warning: ") for line in done.stdout.splitlines() if line.startswith("warning: ")]
    assert done.returncode == 0
    assert len(said) == 2
    assert summary(tmp_path / "r")["warnings"] == said
    log, page = ((tmp_path / "r" / name).read_text(encoding="utf-8") for name in ("run.log", "report.html"))
    assert all(sentence in log for sentence in said)
    assert all(sentence.replace("'", "&#39;") in page for sentence in said)
    checked = hvi("check", path)
    assert [line for line in checked.stdout.splitlines() if line.startswith("warning: ")] == [f"warning: {said[0]}"]
    assert json.loads(hvi("check", path, "--json").stdout)["warnings"] == said[:1]
