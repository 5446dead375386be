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


def test_a_jump_is_tried_in_another_way_where_its_first_curve_comes_to_singular_equations() -> None:
    """A strip that is lifted off bonds of two drops; a single run bears 0.99 of the peak, and nothing above it."""
    adhesion = [[0, 0], [1.27e-06, 18.64], [1.27e-06, 4.565], [3.472e-06, 7.609], [3.472e-06, 0.0]]
    friction = [[0, 0], [4.105e-07, 54.59], [1.425e-06, 26.47], [1.624e-06, 34.94], [2.258e-06, 50.5]]
    glue = {
        "on": "bottom",
        "adhesion": {"law": "graph", "points": adhesion, "multiplier": "1.253+0.5597*x"},
        "friction": {"law": "graph", "points": friction},
        "contact": {"gap": 0.0},
    }
    scene = {
        "domain": {"shape": "rectangle", "size": [1.0, 0.3703], "cells": [3, 1]},
        "material": {"model": "plane_stress", "youngs_modulus": 1895000.0, "poisson_ratio": 0.3},
        "boundary": {"glue": glue, "pull": {"on": "top", "traction": [0.567, 13.76]}},
    }
    path = hvi.follow(hvi.read_tables(scene), to=1.5, memory=False)
    assert path.end == "escapes"
    for part, code in ((0.99, 0), (1.01, 4)):
        pull = {"on": "top", "traction": [part * path.peak_factor * p for p in (0.567, 13.76)]}
        loaded = {**scene, "boundary": {"glue": glue, "pull": pull}}
        assert hvi.solve(hvi.read_tables(loaded), estimate=False).exit_code == code


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


def test_a_slender_body_comes_off_once_its_bonds_soften_together() -> None:
    """Sliding bonds all bear what the factor 0.2 asks for: above it nothing holds a body that has jumped that far."""
    size, drop = {"shape": "rectangle", "size": [1.0, 0.01]}, [[0.0, 0.0], [9.3e-8, 3e6], [3.72e-7, 6e5]]
    scene = hvi.read_tables(
        {
            "domain": {
                "lower": {**size, "cells": [7, 7], "origin": [0.0, -0.01]},
                "upper": {**size, "cells": [8, 8]},
            },
            "material": {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
            "boundary": {
                "pull": {"on": "upper.right", "traction": ["3e8*(4 - 6*y/0.01)", 0.0]},
                "press": {"on": "upper.top", "traction": [0.0, "-1e6*(1 - 1.4*x)"]},
                "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
            },
            "interface": {
                "floor": {
                    "between": ["upper.bottom", "lower.top"],
                    "contact": {"gap": 0.0},
                    "friction": {"law": "graph", "points": drop},
                }
            },
            "solver": {"degree": 2},
        }
    )
    path = hvi.follow(scene)
    assert path.end == "escapes"
    assert path.converged
    assert path.peak_factor > 0.2


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
