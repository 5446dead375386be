"""Strengths that statics or energy alone give, whatever the form of the law."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from runs import ROOT
from scenes import P, model

import hvi_fenicsx as hvi

PUSH = 6e5
GLUES = ("[[0,0],[4e-6,5e6],[2e-5,0]]", "[[0,0],[2e-6,1.25e7],[8e-6,0]]")
"""Two laws whose area is 50 J/m²."""


def block(press: float, modulus: float) -> hvi.Model:
    """The demo with another press and modulus; only the push is scaled."""
    changes = [
        f"boundary.press.traction=[0.0,{-press!r}]",
        f"material.youngs_modulus={modulus!r}",
        "domain.cells=[4,4]",
    ]
    changes += ["path.to=3.0", 'path.scaled=["push.traction"]']
    return hvi.read_scene(ROOT / "demos" / "pushed_block.toml", changes)


def test_a_block_tips_where_the_moments_about_its_edge_say() -> None:
    """P H²/2 = Q L²/2 at H = L: the factor Q/P, however it slips and whatever of its floor has opened before."""
    path = hvi.follow(block(press=4e5, modulus=2.15e11))
    assert path.converged
    assert path.end == "escapes"
    assert path.peak_factor == pytest.approx(4e5 / PUSH, rel=1e-9)
    assert path.events.count("release") >= 3


@pytest.mark.parametrize(("modulus", "least"), [(2.15e15, 0.9999), (2.15e11, 0.75)])
def test_a_stiff_block_slides_at_the_peak_of_its_floor_and_an_elastic_one_below(modulus: float, least: float) -> None:
    path = hvi.follow(block(press=4e6, modulus=modulus))
    assert path.converged
    assert path.end == "escapes"
    assert least < path.peak_factor * PUSH / 1e6 < 1.0 + 1e-9


@pytest.mark.long
@pytest.mark.parametrize("points", GLUES)
def test_a_strip_is_peeled_off_by_the_moment_that_the_area_of_the_law_gives(points: str) -> None:
    """M²/(2 E' I) = Gc: the factor of the jump that releases most; what is done before is done at that moment too."""
    scene = hvi.read_scene(ROOT / "demos" / "peeling_moment.toml", [f"boundary.glue.adhesion.points={points}"])
    path = hvi.follow(scene)
    bending = 7e10 / (1 - 0.3**2) * 0.005**3 / 12
    assert path.converged
    assert jumped(path) * 200.0 == pytest.approx(np.sqrt(2 * bending * 50.0), rel=6e-3)


def test_a_block_sinks_where_its_bed_bears_no_more_although_bonds_turn_back_on_the_way() -> None:
    """The bed bears its peak all along at most: 5514 N/m² against 3641 N/m²."""
    friction = {"law": "exponential", "peak_traction": 1838.0, "residual_traction": 0.0, "delta": 1.765e-4}
    bed = {**friction, "peak_traction": 5514.0, "residual_traction": 486.0}
    scene = {
        "domain": {"shape": "rectangle", "size": [1.0, 0.3169], "cells": [3, 2]},
        "material": {"model": "plane_stress", "youngs_modulus": 2517000.0, "poisson_ratio": 0.3},
        "boundary": {
            "pull": {"on": "right", "traction": [4849.0, 0.0]},
            "press": {"on": "top", "traction": [0.0, -3641.0]},
            "floor": {"on": "bottom", "friction": friction, "support": bed},
            "wall": {"on": "left", "displacement": [0.0, "free"]},
        },
    }
    path = hvi.follow(hvi.read_tables(scene), to=1.6)
    assert path.end == "escapes"
    assert path.peak_factor == pytest.approx(5514.0 / 3641.0, rel=1e-4)
    assert path.peak_factor < 5514.0 / 3641.0


def jumped(path: Any) -> float:
    """The factor at which most energy is released."""
    return float(max((path.rows[n] for n in path.jumps), key=lambda row: row.released).factor)


@pytest.mark.parametrize("programme", [2.0, [1.0, -0.5, 2.0]])
def test_a_body_without_contact_and_law_follows_its_straight_path(programme: float | list[float]) -> None:
    """The energy is -½ λ² times the work of the load along the displacement that it alone gives."""
    table = model(pull=P)
    del table["boundary"]["floor"]
    table["boundary"]["wall"]["displacement"] = [0.0, 0.0]
    scene = hvi.read_tables(table)
    path = hvi.follow(scene, to=programme)
    assert path.converged
    assert path.end == "reached"
    assert path.peak_factor == 2.0
    assert path.rows[-1].energy == pytest.approx(4.0 * hvi.solve(scene).energy, rel=1e-10)
