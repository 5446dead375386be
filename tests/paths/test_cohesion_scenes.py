"""Paths of scenes with cohesion between two bodies: their ends against single runs, and several ranks against one."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import tomli_w
from runs import ROOT, hvi, summary
from scenes import Table

import hvi_fenicsx

PEAK, FIRST, LAST = 2.0e6, 1.0e-6, 1.0e-5
MIXED = {"mixity": "benzeggagh_kenane", "energy_ratio": 2.0, "exponent": 2.1}


def blocks(**mixity: Any) -> Table:
    """A block torn off a longer one by a displacement that differs along it; a part of the glue is pressed."""
    glue = {"law": "graph", "points": [[0.0, 0.0], [FIRST, PEAK], [LAST, 0.0]], "beta": 0.7, **mixity}
    return {
        "domain": {
            "lower": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [7, 3]},
            "upper": {"shape": "rectangle", "size": [0.8, 0.4], "cells": [5, 3], "origin": [0.1, 0.5]},
        },
        "material": {"model": "plane_stress", "youngs_modulus": 2.0e11, "poisson_ratio": 0.3},
        "boundary": {
            "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
            "pull": {"on": "upper.top", "displacement": [5.2e-6, "1.75e-5*(x - 0.3)"]},
        },
        "interface": {"glue": {"between": ["upper.bottom", "lower.top"], "contact": {"gap": 0.0}, "cohesion": glue}},
    }


def written(folder: Path, table: Table) -> Path:
    (folder / "scene.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    return folder / "scene.toml"


def rows(folder: Path) -> tuple[list[str], npt.NDArray[np.float64]]:
    """The events, and factor, work and the forces of the pull, by row."""
    found = csv_of(folder / "path.csv")
    keys = ("factor", "work", "dissipated", "pull.fx", "pull.fy")
    found = [row for row in found if row["event"] != "step"]  # where a curve is sampled is nothing that has to agree
    return [row["event"] for row in found], np.array([[float(row[key]) for key in keys] for row in found])


def csv_of(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.long
def test_a_joint_whose_vertices_all_soften_at_once_comes_off_at_its_strength() -> None:
    """S = 3e7 / sqrt(sin⁴ 30° + (sin 30° cos 30° / 0.7)²); the limit points of 28 vertices are 1e-10 apart."""
    path = hvi_fenicsx.follow(hvi_fenicsx.read_scene(ROOT / "demos" / "scarf_joint.toml"), to=1.3)
    strength = 3.0e7 / np.hypot(0.25, 0.25 * np.sqrt(3.0) / 0.7)
    assert path.end == "escapes"
    assert path.peak_factor == pytest.approx(strength / 4.0e7, rel=1e-6)
    assert path.uncertified == 0


@pytest.mark.parametrize("mixity", [{}, MIXED], ids=["one energy", "by mode"])
def test_a_path_ends_where_a_run_at_its_end_does(mixity: Table, tmp_path: Path) -> None:
    """Every row is certified; the run knows nothing of the path."""
    scene = written(tmp_path, blocks(**mixity))
    for command in ("path", "run"):
        done = hvi(command, scene, "--out", tmp_path / command, "--no-pictures")
        assert done.returncode == 0, done.stdout + done.stderr
    events, values = rows(tmp_path / "path")
    assert "kink" in events
    assert summary(tmp_path / "path")["path"]["uncertified"] == 0
    wanted = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))["resultants"]["pull"]
    assert values[-1, 3:] == pytest.approx(wanted, rel=1e-6)


def test_what_is_written_of_a_factor_within_a_curved_path_is_what_a_run_at_this_load_finds(tmp_path: Path) -> None:
    table = blocks() | {"path": {"contact_at": [0.9], "memory": False}}
    assert hvi("path", written(tmp_path, table), "--out", tmp_path / "path", "--no-pictures").returncode == 0
    part = blocks()
    part["boundary"]["pull"]["displacement"] = [0.9 * 5.2e-6, "0.9*1.75e-5*(x - 0.3)"]
    assert hvi("run", written(tmp_path, part), "--out", tmp_path / "run", "--no-pictures").returncode == 0
    found, wanted = (csv_of(tmp_path / name) for name in ("path/path_contact.csv", "run/contact.csv"))
    assert len(found) == len(wanted) > 5
    for name in ("u_n", "u_t1", "sigma_n", "friction_t1"):
        ours, theirs = (np.array([float(row[name]) for row in rows]) for rows in (found, wanted))
        np.testing.assert_allclose(ours, theirs, atol=1e-6 * np.max(np.abs(theirs)))


@pytest.mark.long
@pytest.mark.parametrize("mixity", [{}, MIXED], ids=["one energy", "by mode"])
def test_several_ranks_follow_the_path_that_one_follows(mixity: Table, tmp_path: Path) -> None:
    scene = written(tmp_path, blocks(**mixity))
    found = []
    for ranks in (1, 2, 3):
        done = hvi("path", scene, "--out", tmp_path / str(ranks), "--no-pictures", ranks=ranks)
        assert done.returncode == 0, done.stdout + done.stderr
        found.append(rows(tmp_path / str(ranks)))
    for events, values in found[1:]:
        assert events == found[0][0]
        assert np.allclose(values, found[0][1], rtol=0.0, atol=1e-8 * np.abs(found[0][1]).max(axis=0))


def slip_alone(tmp_path: Path, peak: float, **mixity: Any) -> npt.NDArray[np.float64]:
    """The rows of a strip that slides on a roller with glue, by name of the law's mode."""
    glue = {"law": "graph", "points": [[0.0, 0.0], [1e-4, peak], [1e-3, 0.0]], "beta": 1.0, **mixity}
    table = {
        "domain": {"shape": "rectangle", "size": [1.0, 0.2], "cells": [10, 2]},
        "material": {"model": "plane_strain", "youngs_modulus": 1e10, "poisson_ratio": 0.3},
        "boundary": {
            "pull": {"on": "right", "traction": [6e6, 0.0]},
            "glue": {"on": "bottom", "displacement": ["free", 0.0], "cohesion": glue},
        },
        "path": {"to": 1.0},
    }
    tmp_path.mkdir()
    assert hvi("path", written(tmp_path, table), "--out", tmp_path / "out", "--no-pictures").returncode == 0
    return rows(tmp_path / "out")[1]


def test_a_slip_alone_breaks_with_the_energy_of_the_second_mode(tmp_path: Path) -> None:
    """As the law of three times the tractions."""
    mixed = slip_alone(tmp_path / "mixed", 1e6, **{**MIXED, "energy_ratio": 3.0})
    np.testing.assert_allclose(mixed, slip_alone(tmp_path / "plain", 3e6), rtol=1e-9, atol=1e-6)
