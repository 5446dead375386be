"""A list of sides or regions is one place: what it does, a scene's list does, and one effect for each of them; SI."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from own_mesh import LAW, STEEL, own_square
from scenes import model as scene_table
from scenes import quadratic_linear

import hvi_fenicsx as hvi

PUSHED = [STEEL, hvi.Displacement("wall", [0.0, None]), hvi.Traction("pull", [-2e7, 1e6])]
"""A block that is pushed against a wall and widens."""
PLATES = ["floor", "press"]


@pytest.fixture(scope="module")
def body() -> hvi.Body:
    return own_square()


def solved(body: hvi.Body, *effects: Any) -> hvi.Solution:
    return hvi.solve(hvi.Model(body, [*PUSHED, *effects]), estimate=False, tolerance=1e-12)


def between_plates() -> hvi.Model:
    """The scene of a block between two plates, which are one part."""
    table = scene_table(8)
    sides: dict[str, Any] = {"wall": {"on": "left", "displacement": [0.0, "free"]}}
    sides["pull"] = {"on": "right", "traction": [-2e7, 1e6]}
    sides["plates"] = {"on": ["bottom", "top"], "contact": {"gap": 1e-6}, "friction": quadratic_linear(1e6)}
    return hvi.read_tables({**table, "boundary": sides})


def test_laws_on_a_list_are_those_of_a_scene_and_of_single_sides(body: hvi.Body) -> None:
    found = solved(body, hvi.Contact(PLATES, gap=1e-6), hvi.Friction(tuple(PLATES), LAW))
    same = hvi.solve(between_plates().with_solver(tolerance=1e-12), MPI.COMM_SELF, estimate=False)
    singles = [one for side in PLATES for one in (hvi.Contact(side, gap=1e-6), hvi.Friction(side, LAW))]
    apart = solved(body, *singles)
    assert found.energy == pytest.approx(same.energy, rel=1e-12)
    assert found.energy == pytest.approx(apart.energy, rel=1e-12)
    ours, theirs = found.contact["floor-press"], same.contact["plates"]
    np.testing.assert_allclose(np.sort(ours.slip, axis=0), np.sort(theirs.slip, axis=0), rtol=1e-9, atol=1e-18)
    both = sum(apart.resultant(side) for side in PLATES)
    np.testing.assert_allclose(found.resultant("floor-press"), both, rtol=1e-9, atol=1e-3)
    assert min(np.sum(apart.contact[side].pressure > 0) for side in PLATES) > 0


def test_loads_on_a_list_add_up_and_a_force_is_one(body: hvi.Body) -> None:
    sides = ["press", "pull"]
    held = [hvi.Contact("floor"), hvi.Friction("floor", LAW)]
    found = solved(body, *held, hvi.Traction(sides, [1e5, -2e6]))
    apart = solved(body, *held, *[hvi.Traction(side, [1e5, -2e6]) for side in sides])
    assert found.energy == pytest.approx(apart.energy, rel=1e-12)
    one = solved(body, *held, hvi.Force(sides, [2e5, -4e6]))
    assert one.energy == pytest.approx(found.energy, rel=1e-12)  # 1e5 N/m² on 2 m², not on each


@pytest.mark.parametrize(
    ("side", "reason"),
    [
        (["floor", "pres"], 'Traction: unknown place "pres"; did you mean "press"'),
        ([], "the place is an empty list; name at least one"),
        (["floor", "floor"], "the place names the same thing twice"),
        (["floor", 1], "the place must be a name or a list of names in quotes"),
        ({"floor": 1}, "the place must be a name or a list of names in quotes"),
        (["wall", "end"], 'Traction: unknown place "end"; .*allowed: '),
    ],
)
def test_lists_are_refused_as_in_a_scene_file(body: hvi.Body, side: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        hvi.Model(body.piece("end", "floor", "x > 0.5"), [STEEL, hvi.Traction(side, [0.0, 0.0])])
