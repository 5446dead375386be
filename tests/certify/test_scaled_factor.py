"""Certificates of a path do not hang on its factor's scale: a thousandth of a load a thousand times is the load."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from hvi_fenicsx import follow, read_tables


def strip(size: list[float], cells: list[int], height: float) -> dict[str, Any]:
    return {"shape": "rectangle", "size": size, "cells": cells, "origin": [0.0, height]}


def stack(force: float) -> dict[str, Any]:
    """A block glued on a block, pressed and sheared."""
    return {
        "domain": {"lower": strip([1.0, 1.0], [4, 4], 0.0), "upper": strip([1.0, 1.0], [3, 3], 1.0)},
        "material": {"model": "plane_strain", "youngs_modulus": 1e9, "poisson_ratio": 0.3},
        "boundary": {
            "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
            "load": {"on": "upper.top", "force": [0.5 * force, -force]},
        },
        "interface": {"glue": glue([[0, 0], [1e-3, 1e6], [1e-2, 0]])},
    }


def flexure(force: float) -> dict[str, Any]:
    """Two glued strips in three-point bending."""
    return {
        "domain": {"lower": strip([0.1, 0.0015], [50, 2], 0.0), "upper": strip([0.1, 0.0015], [50, 2], 0.0015)},
        "material": {"model": "plane_strain", "youngs_modulus": 1e11, "poisson_ratio": 0.3},
        "boundary": {
            "load": {"on": "upper.top", "where": "0.048 < x < 0.052", "force": [0.0, -force]},
            "left": {"on": "lower.left", "displacement": ["free", 0.0]},
            "right": {"on": "lower.right", "displacement": [0.0, 0.0]},
        },
        "interface": {"glue": glue([[0, 0], [1e-7, 100e6], [3.4e-5, 0]])},
    }


def glue(points: list[list[float]]) -> dict[str, Any]:
    between = ["upper.bottom", "lower.top"]
    return {"between": between, "contact": {"gap": 0.0}, "cohesion": {"law": "graph", "points": points}}


CASES = [(stack, 1e6), pytest.param(flexure, 4.5e4, marks=pytest.mark.long)]


@pytest.mark.parametrize(("scene", "force"), CASES)
def test_a_factor_in_other_units_leaves_states_and_certificates(scene: Any, force: float) -> None:
    """Steps along a curve are no events: how long they are may differ."""
    found = []
    for scale in (1.0, 1e-3, 1e3):
        path = follow(read_tables(scene(force / scale)), to=scale)
        assert path.summary()["uncertified"] == 0, scale
        rows = [(row.event, row.factor / scale) for row in path.rows if row.event != "step"]
        found.append([*zip(*rows, strict=True)])
    for events, factors in found[1:]:
        assert events == found[0][0]
        np.testing.assert_allclose(factors, found[0][1], rtol=1e-6, atol=1e-9)
