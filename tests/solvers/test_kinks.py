"""Vertices that rest on upward jumps of a law: these must carry their force with its falling parts as they are."""

from __future__ import annotations

import pytest
from scenes import Table, model, solved

FALLS_BEFORE_JUMP: Table = {
    "law": "graph",
    "points": [[0, 0], [1e-8, 4e5], [4.5e-8, -5e4], [4.5e-8, 2.3e5], [1.3e-7, 1.5e5]],
}


@pytest.mark.parametrize(("cells", "pull"), [(1, 2e5), (2, 3e5)])
def test_a_jump_is_judged_with_the_fall_before_it(cells: int, pull: float) -> None:
    """In the first step the law only rises, and a vertex stops at its jump; with the fall, the jump cannot hold it."""
    found = solved(model(cells, pull, 1e6, FALLS_BEFORE_JUMP))
    assert found.exit_code == 0


@pytest.mark.parametrize("floor_friction", [None, 30.0])
def test_along_an_edge_contact_and_other_laws_relieve_the_kink_of_a_slip_vector(floor_friction: float | None) -> None:
    """Where front and floor meet, the floor carries the weight: the front's friction need not hold it, and is stuck."""
    tresca: Table = {"law": "tresca", "yield_traction": 20.0}
    floor: Table = {"on": "bottom", "contact": {"gap": 0.0}}
    if floor_friction is not None:
        floor["friction"] = tresca | {"yield_traction": floor_friction}
    table: Table = {
        "domain": {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [3, 1, 1]},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.15e11, "poisson_ratio": 0.0},
        "boundary": {
            "floor": floor,
            "front": {"on": "front", "contact": {"gap": 0.0}, "friction": tresca},
            "back": {"on": "back", "contact": {"gap": 0.0}},
            "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
            "top": {"on": "top", "traction": [170.0, 0.0, -340.0]},
        },
    }
    assert solved(table).exit_code == 0
