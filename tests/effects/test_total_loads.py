"""Pressure, total force and moment on a part: their resultants, and the same answers as tractions that are known."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from runs import hvi, write_scene
from scenes import NU, E, Table

import hvi_fenicsx
from hvi_fenicsx import InputError, prepare, read_tables
from hvi_fenicsx.workflow import solve


def plate(**loads: Any) -> Table:
    """A plate of 2 m x 0.5 m, clamped at its left side, with these loads on the right one."""
    return {
        "domain": {"shape": "rectangle", "size": [2.0, 0.5], "cells": [8, 2]},
        "material": {"model": "plane_stress", "youngs_modulus": E, "poisson_ratio": NU},
        "boundary": {"wall": {"on": "left", "displacement": [0.0, 0.0]}, "end": {"on": "right", **loads}},
    }


def bar(**loads: Any) -> Table:
    """A bar of 2 m x 0.5 m x 0.4 m, likewise."""
    table = plate(**loads)
    table["domain"] = {"shape": "box", "size": [2.0, 0.5, 0.4], "cells": [4, 2, 2]}
    table["material"]["model"] = "three_dimensional"
    table["boundary"]["wall"]["displacement"] = [0.0, 0.0, 0.0]
    return table


def energy(table: Table) -> float:
    solution = solve(read_tables(table))
    assert solution.examination is not None
    return solution.examination.energy * solution.problem.scales.energy


def resultant(table: Table, about: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment of all loads, SI, from the assembled load vector."""
    prepared = prepare(read_tables(table))
    scales, d = prepared.problem.scales, prepared.problem.scales.dimension
    force = prepared.system.pushing * scales.force
    arm = prepared.problem.points[: len(force), :d] - np.array(about)
    return force.sum(axis=0), np.atleast_1d(np.cross(arm, force).sum(axis=0))


def test_a_force_is_spread_evenly() -> None:
    assert energy(plate(force=[3e5, -1e5])) == pytest.approx(energy(plate(traction=[6e5, -2e5])), rel=1e-10)


def test_a_pressure_acts_against_the_normal() -> None:
    assert energy(plate(pressure="1e6*y")) == pytest.approx(energy(plate(traction=["-1e6*y", 0.0])), rel=1e-10)


def test_a_moment_is_that_of_a_bent_beam() -> None:
    """σ = M r/I with I = h³/12; about z counterclockwise, so the end is pulled below."""
    rate = 12 * 1e5 / 0.5**3
    assert energy(plate(moment=1e5)) == pytest.approx(energy(plate(traction=[f"-{rate}*(y - 0.25)", 0.0])), rel=1e-10)


@pytest.mark.parametrize("moment", [[1e5, 0.0, 0.0], [0.0, 2e5, -1e5]])
def test_a_moment_in_space_has_its_resultant(moment: list[float]) -> None:
    force, turned = resultant(bar(moment=moment), (2.0, 0.25, 0.2))
    assert np.allclose(force, 0.0, atol=1e-6)
    assert np.allclose(turned, moment, atol=1e-9 * 2e5)


def test_a_force_in_space_has_its_resultant() -> None:
    force, turned = resultant(bar(force=[1e4, 2e4, -3e4]), (2.0, 0.25, 0.2))
    assert np.allclose(force, [1e4, 2e4, -3e4], rtol=1e-12)
    assert np.allclose(turned, 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        ({"force": [1.0]}, "force has 1 components; in 2D it has 2"),
        ({"force": ["x", 0.0]}, "is the sum over the part: numbers only"),
        ({"moment": [1.0, 2.0, 3.0]}, "in 2D it is one number"),
    ],
)
def test_what_makes_no_sense_is_refused(loads: Table, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_tables(plate(**loads))


def test_from_python_they_are_the_same() -> None:
    body = hvi_fenicsx.Body.rectangle([2.0, 0.5], [8, 2])
    steel = hvi_fenicsx.Isotropic(youngs_modulus=E, poisson_ratio=NU)
    wall = hvi_fenicsx.Displacement("left", [0.0, 0.0])
    end = [
        hvi_fenicsx.Force("right", [3e5, 0.0]),
        hvi_fenicsx.Moment("right", 1e5),
        hvi_fenicsx.Pressure("right", "1e6*y"),
    ]
    found = hvi_fenicsx.solve(hvi_fenicsx.Model(body, [steel, wall, *end]))
    assert found.energy == pytest.approx(energy(plate(force=[3e5, 0.0], moment=1e5, pressure="1e6*y")), rel=1e-10)


@pytest.mark.long
def test_the_same_on_two_ranks(tmp_path: Path) -> None:
    path = write_scene(tmp_path / "s.toml", plate(force=[3e5, -1e5], moment=1e5, pressure=1e5))
    found = []
    for ranks in ("1", "2"):
        out = tmp_path / ranks
        done = hvi("run", path, "--out", out, "--no-pictures", "--np", ranks)
        assert done.returncode == 0, done.stderr
        found.append((out / "summary.json").read_text())
    first, second = (float(text.split('"energy": ')[1].split(",")[0]) for text in found)
    assert first == pytest.approx(second, rel=1e-10)
