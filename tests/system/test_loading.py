"""The load as a function of a factor against the load of a scene in which the values themselves are multiplied."""

from __future__ import annotations

import copy

import numpy as np
import numpy.typing as npt
import pytest
from scenes import STEEL, Table

from hvi_fenicsx import InputError, prepare, read_tables
from hvi_fenicsx.reduced import loading

FACTOR = -0.4


def scene() -> Table:
    """Held at the left, moved at the right by a formula, pressed (the largest load: it sets the scales) on a slope."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [4, 2]},
        "material": dict(STEEL),
        "body": {"force": [0.0, -1e5]},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, 1e-7]},
            "grip": {"on": "right", "displacement": ["1e-7*(1 + y)", 2e-7]},
            "press": {"on": "top", "traction": [0.0, -1e9]},
            "floor": {"on": "bottom", "contact": {"obstacle": {"point": [0.0, -1e-6], "normal": [0.1, 1.0]}}},
        },
    }


def multiplied(table: Table, names: list[str]) -> Table:
    """The scene with all values of these names multiplied by the factor."""
    found = copy.deepcopy(table)
    for name in names:
        part, key = name.split(".")
        tables = found["body"] if part == "body" else found["boundary"][part]
        tables[key] = [
            v if v == "free" else f"{FACTOR}*({v})" if isinstance(v, str) else FACTOR * v for v in tables[key]
        ]
    return found


def load(table: Table) -> npt.NDArray[np.float64]:
    found: npt.NDArray[np.float64] = prepare(read_tables(table)).system.load.array.copy()
    return found


@pytest.mark.parametrize("names", [["grip.displacement"], ["grip.displacement", "wall.displacement", "body.force"]])
def test_a_factor_multiplies_the_named_loads_and_displacements(names: list[str]) -> None:
    system = prepare(read_tables(scene())).system
    assert system.rotation is not None  # the slope turns components
    constant, rate = loading.make(system, names).lifted.T
    np.testing.assert_allclose(constant + FACTOR * rate, load(multiplied(scene(), names)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(constant + rate, system.load.array, rtol=0, atol=1e-13)


def test_a_name_that_does_not_exist_is_refused_with_those_that_do() -> None:
    system = prepare(read_tables(scene())).system
    with pytest.raises(InputError, match=r"no load 'pull.traction'; there are: body.force, press.traction, wall.disp"):
        loading.make(system, ["pull.traction"])


def test_two_parts_that_share_a_moved_vertex_are_scaled_together() -> None:
    table = scene()
    del table["boundary"]["press"]
    table["boundary"]["lid"] = {"on": "top", "displacement": ["free", "1e-7*(1 + x)"]}
    system = prepare(read_tables(table)).system
    with pytest.raises(InputError, match=r"two boundary parts meet"):
        loading.make(system, ["wall.displacement"])
