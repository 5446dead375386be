"""A list of sides or regions is one place: what it does, a scene's list does, and one effect for each of them; SI."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dolfinx import mesh
from mpi4py import MPI
from own_mesh import LAW, STEEL, TAGS, own_square, steel_square, tagged_square
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


def test_replacing_finds_a_list_in_any_order(body: hvi.Body) -> None:
    model = hvi.Model(body, [*PUSHED, hvi.Contact(PLATES)])
    moved = model.replace(hvi.Contact(PLATES[::-1], gap=1e-6))
    assert hvi.solve(moved).energy == pytest.approx(solved(body, hvi.Contact(PLATES, gap=1e-6)).energy, rel=1e-9)
    assert repr(moved).endswith("Contact on press, floor)")
    with pytest.raises(hvi.InputError, match=r"no contact on floor; .*; contact on floor, press$"):
        model.replace(hvi.Contact("floor"))


def test_regions_in_a_list() -> None:
    square, tags = tagged_square(MPI.COMM_SELF)
    cells = np.arange(square.topology.index_map(2).size_local, dtype=np.int32)
    right = mesh.compute_midpoints(square, 2, cells)[:, 0] > 0.5
    halves = mesh.meshtags(square, 2, cells, np.where(right, 12, 11).astype(np.int32))
    two = hvi.Body(square, tags, halves, names=TAGS, regions={"hard": 11, "soft": 12})
    both = hvi.Isotropic(youngs_modulus=2.15e11, poisson_ratio=0.29, region=["hard", "soft"])
    weight = hvi.BodyForce([0.0, -1e5], region=["soft", "hard"])
    found = hvi.solve(hvi.Model(two, [both, weight, *steel_square(body=two).effects[1:]]))
    same = hvi.solve(hvi.Model(two, [*steel_square(body=two).effects, hvi.BodyForce([0.0, -1e5])]))
    assert found.energy == pytest.approx(same.energy, rel=1e-12)


def test_two_forces_in_a_body_add_up(body: hvi.Body) -> None:
    held = [hvi.Contact("floor"), hvi.Friction("floor", LAW)]
    twice = solved(body, *held, hvi.BodyForce([0.0, -1e6]), hvi.BodyForce([0.0, -1e6]))
    assert twice.energy == pytest.approx(solved(body, *held, hvi.BodyForce([0.0, -2e6])).energy, rel=1e-12)


def test_a_piece_of_several_sides(body: hvi.Body) -> None:
    ends = body.piece("ends", PLATES, "x > 0.5")
    apart = body.piece("low", "floor", "x > 0.5").piece("high", "press", "x > 0.5")
    found, other = solved(ends, hvi.Contact("ends")), solved(apart, hvi.Contact("low"), hvi.Contact("high"))
    assert found.energy == pytest.approx(other.energy, rel=1e-12)


@pytest.mark.parametrize(
    ("side", "reason"),
    [
        (["floor", "pres"], 'Traction: unknown place "pres"; did you mean "press"'),
        ([], "the place is an empty list; name at least one"),
        (["floor", "floor"], "the place names the same thing twice"),
        (["floor", 1], "the place must be a name or a list of names in quotes"),
        ({"floor": 1}, "the place must be a name or a list of names in quotes"),
        (["wall", "end"], "Traction: 'end' stands alone, being a piece or an interface; a list is of whole sides"),
    ],
)
def test_lists_are_refused_as_in_a_scene_file(body: hvi.Body, side: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        hvi.Model(body.piece("end", "floor", "x > 0.5"), [STEEL, hvi.Traction(side, [0.0, 0.0])])
