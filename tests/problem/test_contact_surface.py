"""Why: a tangent that turns round changes the sign of a slip; results compare only where the rule is kept."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from scenes import model

from hvi_fenicsx import InputError, prepare, read_tables
from hvi_fenicsx.geometry import tangents


@pytest.mark.parametrize("degrees", [0, 20, 44, 46, 70, 90, 135, 160])
def test_in_space_the_first_tangent_is_the_projected_axis(degrees: float) -> None:
    """The x-axis, or the y-axis where the normal is within 45° of x; the second completes a right-handed frame."""
    angle = np.radians(degrees)
    normal = np.array([np.cos(angle), 0.3 * np.sin(angle), np.sqrt(0.91) * np.sin(angle)])
    axis = np.eye(3)[1 if min(degrees, 180 - degrees) < 45 else 0]
    (first, second) = tangents(normal[None])[0]
    projected = axis - (axis @ normal) * normal
    np.testing.assert_allclose(first, projected / np.linalg.norm(projected), atol=1e-14)
    np.testing.assert_allclose(second, np.cross(normal, first), atol=1e-14)


@pytest.mark.parametrize("degrees", [0, 30, 60, 90, 120, 180, 225, 300])
def test_in_the_plane_the_larger_component_of_the_tangent_is_positive(degrees: float) -> None:
    normal = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    ((tangent,),) = tangents(normal[None])
    assert tangent @ normal == pytest.approx(0.0, abs=1e-15)
    assert np.linalg.norm(tangent) == pytest.approx(1.0)
    assert tangent[np.argmax(np.abs(tangent))] > 0


@pytest.mark.parametrize("rise", [-1e-5, 1e-5])
def test_a_support_beyond_either_of_two_bounds_is_refused(rise: float) -> None:
    """Where the wall meets the floor it would hold the body outside of what contact allows."""
    table = model(2, gap=0.0)
    table["boundary"]["floor"] = {"on": "bottom", "contact": {"lower": -2e-6, "upper": 2e-6}}
    table["boundary"]["wall"]["displacement"] = [0.0, 0.1 * rise]
    assert prepare(read_tables(table)).system.dofs == 18
    table["boundary"]["wall"]["displacement"] = [0.0, rise]
    with pytest.raises(InputError, match="violates the contact bound"):
        prepare(read_tables(table))


def obstacle(height: float, normal: float) -> dict[str, dict[str, list[float]]]:
    """A flat obstacle at a height, above (-1) or below (1) the body."""
    return {"obstacle": {"point": [0.0, height], "normal": [0.0, normal]}}


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        ({"floor": ("bottom", {"lower": "1e-6*(1 - 4*x)", "upper": 0.0})}, "boundary.floor: at (0, 0), u·n"),
        (
            {"floor": ("bottom", {"lower": 1e-6, "upper": 2e-6}), "stop": ("right", obstacle(3e-6, 1.0))},
            "at (1, 0), a vertex of boundary.stop too, u·n would have to be at least -2e-06 m",
        ),
        (
            {"floor": ("bottom", {"gap": 0.0}), "stop": ("right", obstacle(-1e-6, -1.0))},
            "at (1, 0), a vertex of boundary.stop too, u·n would have to be at least 1e-06 m and at most 0 m",
        ),
    ],
)
def test_bounds_that_no_displacement_satisfies_are_bad_input(
    parts: dict[str, tuple[str, dict[str, Any]]], text: str
) -> None:
    table = model(4)
    del table["boundary"]["floor"]
    for name, (side, contact) in parts.items():
        table["boundary"][name] = {"on": side, "contact": contact}
    with pytest.raises(InputError, match=re.escape(text)):
        prepare(read_tables(table))


def test_bounds_that_meet_in_one_value_are_no_contradiction() -> None:
    table = model(4)
    table["boundary"]["floor"]["contact"] = {"lower": "1e-6*x", "upper": "1e-6*x"}
    prepare(read_tables(table))
