"""Pieces of sides: two of them are the side, one is what tags of facets give, and coarser meshes need not have them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from dolfinx import mesh as dmesh
from mpi4py import MPI
from own_mesh import LAW, TAGS, own_square, steel_square, tagged_square
from scenes import Table, model, quadratic_linear

import hvi_fenicsx as hvi
from hvi_fenicsx.mesh.boundary_part import Inequalities

FRICTION = quadratic_linear(1e6)


def solved(table: Table, **options: Any) -> hvi.Solution:
    found = hvi.solve(hvi.read_tables(table), estimate=False, **options)
    assert found.converged
    return found


def divided(table: Table, side: str, *pieces: str) -> Table:
    """The scene with a table for each piece in the place of that of a side."""
    parts = dict(table["boundary"])
    own = parts.pop(side)
    return {**table, "boundary": parts | {f"{side}{i}": {**own, "where": w} for i, w in enumerate(pieces)}}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x > 0.3", [False, True, True]),
        ("0.1 < x <= 0.5 and y < 1", [True, True, False]),
        ("not x < 0.4 or y == 1", None),
        ("not (x < 0.4) or x + y > 1.1", [True, True, True]),
        ("x > 0.3; y", None),
        ("x", None),
        ("x > exec", None),
        ("x > 0.3 # half", None),
    ],
)
def test_inequalities_hold_where_python_says(text: str, expected: list[bool] | None) -> None:
    points = np.array([[0.2, 0.95, 0.0], [0.4, 0.0, 0.0], [1.0, 0.0, 0.0]])
    if expected is None:
        with pytest.raises(hvi.InputError):
            Inequalities(text)
    else:
        assert Inequalities(text).at(points).tolist() == expected


def test_two_pieces_are_the_side() -> None:
    """Load, contact and law in two pieces each, and in one; the floor breaks in a part of it."""
    whole = model(8, 3e6, friction=FRICTION)
    parts = divided(divided(whole, "floor", "x < 0.5", "x >= 0.5"), "pull", "y < 0.25", "y > 0.25")
    one, two = solved(whole), solved(parts)
    assert two.energy == pytest.approx(one.energy, rel=1e-11)
    pressures = [two.contact[name].weight @ two.contact[name].pressure for name in ("floor0", "floor1")]
    assert sum(pressures) == pytest.approx(one.contact["floor"].weight @ one.contact["floor"].pressure, rel=1e-10)
    np.testing.assert_allclose(two.resultant("pull0"), [0.25 * 3e6, 0.0], rtol=1e-10, atol=1e-3)


def test_a_piece_is_what_tags_of_facets_give() -> None:
    square, tags = tagged_square(MPI.COMM_SELF)
    values = tags.values.copy()
    floor = tags.indices[values == TAGS["floor"]]
    left = floor[dmesh.compute_midpoints(square, 1, floor)[:, 0] < 0.4]
    values[np.isin(tags.indices, left)] = 9
    body = hvi.Body(square, facets=dmesh.meshtags(square, 1, tags.indices, values), names=TAGS)
    by_tags = hvi.solve(steel_square(body=body), estimate=False)
    rest = own_square().piece("rest", "floor", "x > 0.4")
    floor = [hvi.Contact("rest"), hvi.Friction("rest", LAW)]
    moved = [e for e in steel_square(body=rest).effects if e.where != ("floor",)] + floor
    from_python = hvi.solve(hvi.Model(rest, moved), estimate=False)
    assert from_python.energy == pytest.approx(by_tags.energy, rel=1e-11)
    with pytest.raises(hvi.InputError, match="there is a side 'floor' already"):
        rest.piece("floor", "wall", "y > 0.5")
    by_piece = solved(divided(model(8, 3e6, friction=FRICTION), "floor", "x > 0.4"))
    assert by_piece.energy == pytest.approx(by_tags.energy, rel=1e-11)
    assert len(by_piece.contact["floor0"].x) == len(by_tags.contact["floor"].x) < 9


def test_pieces_in_space() -> None:
    table: Table = {
        "domain": {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [4, 4, 2]},
        "material": {"model": "three_dimensional", "youngs_modulus": 2e11, "poisson_ratio": 0.3},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, 0.0, "free"]},
            "press": {"on": "top", "where": "x + y < 1.2", "traction": [0.0, 0.0, -1e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}},
        },
    }
    found = solved(divided(table, "floor", "x < 0.5 and y < 0.5", "x > 0.5 or y > 0.5"))
    assert found.energy == pytest.approx(solved(table).energy, rel=1e-11)
    area = sum(1 / 16 for i in range(4) for j in range(4) if (i + j + 1) / 4 < 1.2)  # x + y of both triangles' middles
    np.testing.assert_allclose(found.resultant("press"), [0.0, 0.0, -1e6 * area], rtol=1e-9, atol=1e-3)
