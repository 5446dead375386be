"""Why: a scale that is off by a length solves the same problem, at tolerances that mean something else than is said."""

from __future__ import annotations

from typing import Any

import pytest
from scenes import E, model

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.problem.scaling import Scales


def scales(size: tuple[float, float] = (3.0, 2.0), body: Any = None, **boundary: Any) -> Scales:
    """Of a body of length 3, held at its left, with nothing on its other sides but what is given."""
    table = model(2)
    table["domain"]["size"] = list(size)
    table["material"]["thermal_expansion"] = 1e-5
    held = {"wall": {"on": "left", "displacement": [0.0, 0.0]}}
    table["boundary"] = held | boundary
    if body:
        table["body"] = body
    return prepare(read_tables(table)).problem.scales


def test_the_largest_load_counts_in_whatever_order() -> None:
    loads = [{"on": "right", "traction": [5.0e5, 0.0]}, {"on": "top", "traction": [0.0, "-2e5*(1 + x)"]}]
    for first, second in (loads, loads[::-1]):
        assert scales(a=first, b=second).stress == pytest.approx(8.0e5)


def test_a_load_that_is_zero_at_all_vertices_counts() -> None:
    """Two facets of 1.5 m: at their ends a sine is zero but for rounding, which made the unit of stress."""
    assert scales(top={"on": "top", "traction": [0.0, "1e6*sin(pi*x/1.5)"]}).stress == pytest.approx(1.0e6)


def test_a_force_per_volume_counts_times_the_length() -> None:
    found = scales(body={"force": [0.0, -2.0e5]})
    assert found.length == pytest.approx(3.0)
    assert found.stress == pytest.approx(6.0e5)


def test_without_a_load_displacements_and_heat_count_as_strains() -> None:
    moved = scales(pull={"on": "right", "displacement": [3.0e-4, "free"]})
    assert moved.stress == pytest.approx(E * 1.0e-4)
    assert scales(body={"temperature": 20.0}).stress == pytest.approx(E * 2.0e-4)
