"""Load paths that move an obstacle: against closed forms, and against single runs with the obstacle put there."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import Table

import hvi_fenicsx as hvi

E, FORCE, WAY = 1e9, 2e4, 1e-3
FRICTION = {"law": "graph", "points": [[0, 0], [2e-6, 2e5], [8e-6, 4e5]]}


def column(**changes: Any) -> hvi.Model:
    """A column of height 0.5 m and area 0.12 m² under a rigid plate that goes down by a millimetre."""
    plate = {"point": [0.0, 0.0, 0.5], "normal": [0.0, 0.0, -1.0], "displacement": [0.0, 0.0, -WAY]}
    return hvi.read_tables(
        {
            "domain": {"shape": "box", "size": [0.4, 0.3, 0.5], "cells": [2, 1, 2]},
            "material": {"model": "three_dimensional", "youngs_modulus": E, "poisson_ratio": 0.0},
            "boundary": {
                "base": {"on": "bottom", "displacement": [0.0, 0.0, 0.0]},
                "lid": {"on": "top", "contact": {"obstacle": plate | changes}},
            },
        }
    )


def punch(way: float = WAY, friction: Table | None = None, **obstacle: Any) -> hvi.Model:
    """A roller that stands 0.2 mm over a block, and is pressed into it; the block is pushed from the left."""
    roller = {"shape": "sphere", "center": [0.5, 40.5002], "radius": 40.0, "direction": [0, 1]}
    floor = {"friction": FRICTION if friction is None else friction} if friction != {} else {}
    return hvi.read_tables(
        {
            "domain": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [16, 8]},
            "material": {"model": "plane_strain", "youngs_modulus": E, "poisson_ratio": 0.3},
            "boundary": {
                "base": {"on": "bottom", "displacement": [0.0, 0.0]},
                "side": {"on": "left", "where": "y > 0.2 and y < 0.3", "traction": [FORCE, 0.0]},
                "top": {
                    "on": "top",
                    "where": "x > 0.2 and x < 0.8",
                    "contact": {"obstacle": roller | {"displacement": [0.0, -way]} | obstacle},
                    **floor,
                },
            },
        }
    )


def test_a_plate_that_goes_down_and_up_compresses_a_column() -> None:
    """Force, energy and work are those of a bar; above the column the plate touches nothing."""
    path = hvi.follow(column(), to=[1.0, -0.5, 0.5])
    assert path.end == "reached"
    assert path.uncertified == 0
    down = np.maximum(path.factors, 0.0) * WAY
    np.testing.assert_allclose(path.force("lid")[:, 2], -E * 0.12 / 0.5 * down, atol=1e-9 * E * WAY)
    np.testing.assert_allclose(path.displacement("lid")[:, 2], -down, atol=1e-12)
    energies = 0.5 * E * 0.12 / 0.5 * down**2
    np.testing.assert_allclose([row.energy for row in path.rows], energies, atol=1e-9 * energies.max())
    np.testing.assert_allclose([row.work for row in path.rows], energies, atol=1e-9 * energies.max())


@pytest.mark.parametrize("friction", [{}, FRICTION], ids=["smooth", "with friction"])
def test_a_roller_presses_as_in_single_runs_with_the_roller_there(friction: Table) -> None:
    """Also while a traction grows; the path begins with a gap that closes."""
    path = hvi.follow(punch(friction=friction), memory=False)
    assert path.end == "reached"
    assert path.uncertified == 0
    assert sum(row.event == "contact" for row in path.rows) > 3
    closed = [row for row in path.rows if row.factor > 0.3]
    for row in (closed[0], closed[len(closed) // 2], closed[-1]):
        table = punch(row.factor * WAY, friction).tables()
        table["boundary"]["side"]["traction"] = [row.factor * FORCE, 0.0]
        single = hvi.solve(hvi.read_tables(table), estimate=False)
        assert single.converged
        np.testing.assert_allclose(row.forces["top"], single.resultant("top"), rtol=1e-6, atol=1e-6 * FORCE)
        assert row.energy == pytest.approx(single.energy, rel=1e-7)
        # what loads and obstacle put in is elastic energy, or has been lost in the law
        loads = row.forces["side"] @ row.displacements["side"]
        assert row.work == pytest.approx(row.energy + loads, rel=1e-9)


@pytest.mark.parametrize(
    ("scene", "said"),
    [
        (punch(friction={}, direction=None), "do not change in proportion"),
        (punch(friction={}, displacement=[1e-4, -1e-3]), "do not change in proportion"),
    ],
)
def test_an_obstacle_whose_gaps_change_otherwise_is_not_moved_by_a_path(scene: hvi.Model, said: str) -> None:
    with pytest.raises(hvi.InputError, match=said):
        hvi.follow(scene)
    assert hvi.follow(scene, scaled=["side.traction"]).end == "reached"


@pytest.mark.parametrize(
    ("law", "obstacle", "said"),
    [
        ("friction", {"displacement": [1e-4, -1e-3]}, "move it along the normal"),
        ("adhesion", {}, "let it stand still"),
    ],
)
def test_laws_that_would_feel_the_displacement_of_an_obstacle_are_refused(law: str, obstacle: Table, said: str) -> None:
    table = punch(friction={}, **obstacle).tables()
    table["boundary"]["top"][law] = FRICTION
    with pytest.raises(hvi.InputError, match=said):
        hvi.check(hvi.read_tables(table))
