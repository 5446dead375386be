"""What ``hvi check`` prints of the existence question, against statics and as a person reads it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from runs import ROOT, hvi, write_scene
from scenes import model

from hvi_fenicsx import console, prepare, read_tables
from hvi_fenicsx.rigid import Mode, RigidBody
from hvi_fenicsx.workflow import find_solution

TOWER = ROOT / "demos" / "tipping_tower.toml"
WEIGHT, WIND = 2.5e4 * 1.0 * 4.0 * 0.5, 5.0e3 * 4.0 * 2.0
"""Moments of the tower's weight and of its wind about the front edge, N."""


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.long)])
def test_the_factors_of_a_named_load_are_those_of_statics(ranks: int) -> None:
    """The tower stands up to 1.25 times its wind, and as long as it keeps 0.8 of its weight."""
    words = ("check", TOWER, "--load", "wind", "--load", "body", "--json")
    done = hvi(*words, ranks=ranks)
    assert done.returncode == 0
    factors = json.loads(done.stdout)["load_factors"]
    wind, body = factors["wind"], factors["body"]
    assert wind["peak"] == pytest.approx(WEIGHT / WIND, rel=1e-8)
    assert (wind["held_from"], wind["held"]) == pytest.approx((-WEIGHT / WIND, WEIGHT / WIND), rel=1e-8)
    assert wind["peak_direction"] == "rotation about (1, 0), clockwise"
    assert body["held_from"] == pytest.approx(WIND / WEIGHT, rel=1e-8)
    assert (body["held"], body["peak"]) == (None, None)


def test_the_lines_of_a_named_load_say_the_same() -> None:
    lines = hvi("check", TOWER, "--load", "wind", "--load", "body").stdout.splitlines()
    wind, body = (line for line in lines if line.startswith("load "))
    assert [float(x) for x in re.findall(r"-?\d+\.\d+", wind)] == [-1.25, 1.25, 1.25]
    assert body == "load body alone: held at factors above 0.8; no peak"


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.long)])
def test_the_sizes_are_those_of_the_scene(ranks: int) -> None:
    """A tower of 1 m by 4 m with 2.5e4 N/m³ of weight, and 5e3 N/m² of wind along its height."""
    sizes = json.loads(hvi("check", TOWER, "--json", ranks=ranks).stdout)["sizes"]
    assert sizes["body"] == pytest.approx([1.0, 4.0])
    assert sizes["parts"] == pytest.approx({"wind": 4.0, "floor": 1.0})
    assert sizes["loads"]["body.force"] == pytest.approx([0.0, -2.5e4 * 4.0])
    assert sizes["loads"]["wind.traction"] == pytest.approx([5.0e3 * 4.0, 0.0])
    assert "sum of wind.traction: (2e+04, 0) N/m" in hvi("check", TOWER, ranks=ranks).stdout


@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.long)])
def test_the_force_on_an_obstacle_is_told_in_the_units_of_the_scene(tmp_path: Path, ranks: int) -> None:
    table = model(4)
    plate = {"point": [0.0, 1.0], "normal": [0.0, -1.0], "force": [300.0, -2e4]}
    table["boundary"]["lid"] = {"on": "top", "contact": {"obstacle": plate}}
    file = write_scene(tmp_path / "pressed.toml", table)
    sizes = json.loads(hvi("check", file, "--json", ranks=ranks).stdout)["sizes"]
    assert sizes["obstacle_forces"] == {"lid.contact": pytest.approx([300.0, -2e4])}
    assert "force on the obstacle of lid.contact: (300, -2e+04) N/m" in hvi("check", file, ranks=ranks).stdout


def test_a_load_that_is_not_there_is_told_with_those_that_are() -> None:
    done = hvi("check", TOWER, "--load", "snow")
    assert done.returncode == 2
    assert "there is no load 'snow'; there are: body.force, wind.traction" in done.stderr
    assert "Traceback" not in done.stderr


def test_few_rigid_motions_are_named_and_many_are_counted(tmp_path: Path) -> None:
    """Twelve motions in words are no line that a person reads."""
    bodies = [RigidBody(3, np.zeros(3), name=f"body {i}", index=i) for i in (1, 2)]
    names = [Mode(f"motion {i}", (0.0,) * 6) for i in range(12)]
    assert console.motions([], bodies) == "none"
    assert console.motions(names[:3], bodies) == "motion 0, motion 1, motion 2"
    assert console.motions(names[:11], bodies) == "11 (`hvi check --json` lists them)"
    assert console.motions(names, bodies) == "all 12 of 2 bodies"
    assert console.motions(names[:6], bodies[:1]) == "all 6"
    file = write_scene(tmp_path / "square.toml", model(3))
    assert "that the supports leave: translation along y; " in hvi("check", file).stdout


@pytest.mark.parametrize(("cells", "linear"), [(8, "MUMPS"), (64, "CG with geometric multigrid on the mesh hierarchy")])
def test_the_linear_solver_is_the_one_that_a_run_takes(cells: int, linear: str) -> None:
    """On 64 x 64 cells a coarser level pays."""
    prepared = prepare(read_tables(model(cells)))
    assert console.solver(prepared).endswith(linear)
    found = find_solution(prepared)
    assert found.solution.converged
    assert bool(found.levels) == ("multigrid" in linear)
