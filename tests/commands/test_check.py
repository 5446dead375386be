"""What ``hvi check`` prints of the existence question, against statics and as a person reads it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from runs import ROOT, hvi, write_scene
from scenes import model

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
