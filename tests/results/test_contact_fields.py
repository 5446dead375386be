"""``contact.pvd`` and ``contact.csv``: tangents as vectors; nothing where nothing acts."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from scenes import model, quadratic_linear

import hvi_fenicsx as hvi

pyvista = pytest.importorskip("pyvista")


def test_tangents_are_vectors_that_turn_slips_into_displacements(tmp_path: Path) -> None:
    scene = hvi.read_tables(
        {
            "domain": {"shape": "box", "size": [1.0, 0.5, 0.5], "cells": [2, 2, 2]},
            "material": {"model": "three_dimensional", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
            "boundary": {
                "push": {"on": "top", "traction": [2e5, 1e5, -1e6]},
                "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": quadratic_linear(1e6)},
            },
        }
    )
    hvi.solve(scene, estimate=False).write(tmp_path / "r", pictures=False)
    body, part = (pyvista.get_reader(tmp_path / "r" / f).read()[0] for f in ("displacement.pvd", "contact.pvd"))
    t1, t2 = (part.point_data[name] for name in ("t1", "t2"))
    np.testing.assert_allclose(np.cross(t1, t2), np.tile([0.0, 0.0, -1.0], (len(t1), 1)), atol=1e-7)
    at = [body.find_closest_point(point) for point in part.points]
    moved = body.point_data["displacement"][at]
    slips = part.point_data["u_t1"][:, None] * t1 + part.point_data["u_t2"][:, None] * t2
    size = np.abs(moved).max()
    assert size > 0.0
    np.testing.assert_allclose(slips[:, :2], moved[:, :2], atol=1e-5 * size)


def test_a_part_without_a_law_has_no_friction_also_at_the_corner_of_a_support(tmp_path: Path) -> None:
    """The corner's reaction along the floor is the wall's."""
    table = model(4)
    table["boundary"]["floor"].pop("friction", None)
    hvi.solve(hvi.read_tables(table), estimate=False).write(tmp_path / "r", pictures=False)
    with (tmp_path / "r" / "contact.csv").open(encoding="utf-8") as stream:
        rows = [row for row in csv.DictReader(stream) if row["part"] == "floor"]
    assert len(rows) == 5
    assert all(row["friction_t1"] == "" and row["sigma_n"] for row in rows)
