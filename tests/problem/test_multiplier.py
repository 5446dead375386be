"""Laws whose tractions change from place to place: against pieces with laws of their own, and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pieces import LIFTED, TENSILE, assert_equal, assert_same_equilibria, solved
from scenes import DELTA, STEEL, Table, block, model, quadratic_linear, two_blocks

import hvi_fenicsx as hvi

STEP = "3 if x < 0.49 else (2 if x < 0.51 else 1)"
"""At the vertex of both pieces it is their mean, as their areas there are equal."""


def times(law: Table, factor: float) -> Table:
    """The law with all its tractions multiplied by a factor, stated by its parameters."""
    if law["law"] == "graph":
        return {**law, "points": [[x, factor * t] for x, t in law["points"]]}
    return {**law, **{key: factor * law[key] for key in law.keys() - {"law", "delta", "reference_slip"}}}


def both(table: Table, laws: dict[str, Table]) -> tuple[Table, Table]:
    """A scene whose floor has laws of one multiplier, a formula; and the same as two pieces with laws of their own."""
    parts = dict(table["boundary"])
    floor = {key: value for key, value in parts.pop("floor").items() if key not in laws}
    formula = floor | {key: law | {"multiplier": STEP} for key, law in laws.items()}
    left = floor | {"where": "x < 0.5"} | {key: times(law, 3.0) for key, law in laws.items()}
    right = floor | {"where": "x > 0.5"} | laws
    return {**table, "boundary": parts | {"floor": formula}}, {
        **table,
        "boundary": parts | {"left": left, "right": right},
    }


@pytest.mark.parametrize(
    ("laws", "solver"),
    [
        ({"friction": quadratic_linear(0.4e6)}, {}),
        ({"friction": quadratic_linear(0.4e6), "adhesion": TENSILE}, {"degree": 2}),
        ({"friction": quadratic_linear(0.4e6)}, {"smoothing": "quadratic", "epsilon": 0.05, "method": "snes_vi"}),
        ({"friction": quadratic_linear(0.4e6)}, {"smoothing": "paper", "epsilon": 0.5, "method": "condensed"}),
        ({"cohesion": TENSILE | {"beta": 0.7}}, {}),
    ],
)
def test_a_step_of_the_multiplier_is_two_pieces_with_their_own_laws(laws: Table, solver: Table) -> None:
    table = model(8, 3e6, **solver)
    if "cohesion" in laws or "adhesion" in laws:
        table["boundary"]["press"] = LIFTED
    formula, pieces = both(table, laws)
    one, two = solved(formula), solved(pieces)
    assert_equal(one, two, ("floor", "left"), slice(0, -1) if "degree" not in solver else slice(0, -2))


def test_paths_and_all_equilibria_follow_the_multiplier() -> None:
    formula, pieces = (hvi.read_tables(t) for t in both(model(4, 6e6), {"friction": quadratic_linear(3e6)}))
    assert_same_equilibria(formula, pieces)
    paths = [hvi.follow(scene, follow="exact") for scene in (formula, pieces)]
    peaks = [[row.factor for row in path.rows if row.event in ("fold", "end")] for path in paths]
    assert peaks[0] == pytest.approx(peaks[1], rel=1e-8)
    assert all(row.certified for row in paths[0].rows)


def test_a_block_slides_when_the_load_is_the_integral_of_the_multiplier() -> None:
    """Tresca friction of yield traction p (1 + x) on a floor of unit length carries 3/2 p, and gives p (1 + x)."""
    law = {"law": "tresca", "yield_traction": 2e5, "multiplier": "1 + x"}
    held = hvi.prepare(hvi.read_tables(block(5, 1e6, 1e6, law)))
    assert held.load_factors("pull").peak == pytest.approx(1.5 * 2e5 / 1e6, rel=1e-9)
    grip = block(5, 0.0, 1e6, law)
    grip["boundary"]["pull"] = {"on": "right", "displacement": [1e-3, "free"]}
    floor = solved(grip).contact["floor"]
    np.testing.assert_allclose(np.abs(floor.friction[1:-1]), 2e5 * (1 + floor.x[1:-1, 0]), rtol=1e-8)


@pytest.mark.parametrize(
    "make",
    [
        lambda law: model(8, 3e6, friction=law),
        lambda law: {
            "domain": {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [3, 3, 2]},
            "material": STEEL | {"model": "three_dimensional"},
            "boundary": {
                "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
                "pull": {"on": "right", "traction": [3e6, 2e5, 0.0]},
                "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
                "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": law},
            },
            "solver": {},
        },
        lambda law: _with_seam(two_blocks("rectangle", [1.0], [[5, 3], [4, 2]], "plane_stress"), law),
    ],
    ids=["plane", "space", "interface"],
)
def test_a_constant_multiplier_is_another_unit_of_the_tractions(make: Any) -> None:
    """Also in the certificate and in the estimated errors."""
    law = quadratic_linear(1e6, DELTA)
    one, two = (solved(make(table), estimate=True) for table in (law, times(law, 1e-3) | {"multiplier": "1e3 + 0*x"}))
    assert two.energy == pytest.approx(one.energy, rel=1e-11)
    assert one.estimate is not None
    assert two.estimate is not None
    assert two.estimate.relative == pytest.approx(one.estimate.relative, rel=1e-7)
    assert two.certificate.inclusion == pytest.approx(one.certificate.inclusion, abs=1e-11)


def _with_seam(table: Table, law: Table) -> Table:
    table["interface"]["seam"]["friction"] = law
    return table


def test_models_from_python_give_multipliers_as_functions() -> None:
    from own_mesh import steel_square

    square = steel_square()
    law = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=DELTA)
    found = []
    for multiplier in ("1 + x", lambda x: 1 + x[0]):
        effects = [
            e if not isinstance(e, hvi.Friction) else hvi.Friction("floor", law, multiplier=multiplier)
            for e in square.effects
        ]
        found.append(hvi.solve(hvi.Model(square.body, effects), estimate=False))
    assert found[0].energy == pytest.approx(found[1].energy, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({"multiplier": "x - 0.5"}, "must be positive at every vertex"),
        ({"multiplier": -1.0}, "must be positive"),
    ],
)
def test_what_is_refused(law: Table, said: str) -> None:
    with pytest.raises((hvi.InputError, ValueError), match=said):
        hvi.prepare(hvi.read_tables(model(4, friction={"law": "tresca", "yield_traction": 1e6} | law)))
