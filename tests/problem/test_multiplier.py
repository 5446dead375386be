"""Laws whose tractions or lengths change from place to place: against pieces with laws of their own, closed forms."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from scenes import DELTA, STEEL, Table, block, model, quadratic_linear, two_blocks

import hvi_fenicsx as hvi

TENSILE: Table = {"law": "graph", "points": [[0, 0], [2e-6, 4e5], [9e-6, 1e5]]}
LIFTED: Table = {"on": "top", "traction": [0.0, "1e6*(2*x - 0.9)"]}
TRACTIONS, LENGTHS = "multiplier", "length_multiplier"
FACTOR = 2.5
KEYS = pytest.mark.parametrize("key", [TRACTIONS, LENGTHS])


def solved(table: Table, **options: Any) -> hvi.Solution:
    """The solution without its estimate, which has converged."""
    found = hvi.solve(hvi.read_tables(table), **{"estimate": False, **options})
    assert found.converged
    return found


def times(law: Table, key: str, factor: float = FACTOR) -> Table:
    """The law with all its tractions or lengths multiplied by a factor, stated by its parameters."""
    if law["law"] == "graph":
        across, up = (factor, 1.0) if key == LENGTHS else (1.0, factor)
        return {**law, "points": [[across * x, up * t] for x, t in law["points"]]}
    lengths = law.keys() & {"delta", "reference_slip"}
    changed = lengths if key == LENGTHS else law.keys() - lengths - {"law"}
    return {**law, **{name: factor * law[name] for name in changed}}


def both(table: Table, laws: dict[str, Table], key: str) -> tuple[Table, Table]:
    """A scene with laws of one multiplier, a formula; and the same as two pieces, apart, with their own laws."""
    parts = dict(table["boundary"])
    floor = {name: value for name, value in parts.pop("floor").items() if name not in laws}
    middle = {"middle": floor | {"where": "abs(x - 0.5) < 0.25"}}
    step = {key: f"{FACTOR} if x < 0.5 else 1"}
    sides = floor | {"where": "abs(x - 0.5) > 0.25"} | {name: law | step for name, law in laws.items()}
    left = floor | {"where": "x < 0.25"} | {name: times(law, key) for name, law in laws.items()}
    right = floor | {"where": "x > 0.75"} | laws
    one, two = parts | middle | {"sides": sides}, parts | middle | {"left": left, "right": right}
    return {**table, "boundary": one}, {**table, "boundary": two}


@KEYS
@pytest.mark.parametrize(
    ("laws", "solver"),
    [
        ({"friction": {"law": "graph", "points": [[0, 1e5], [3e-6, 1e5], [3e-6, 6e5]]}}, {}),
        ({"friction": quadratic_linear(0.4e6), "adhesion": TENSILE}, {"degree": 2}),
        ({"friction": quadratic_linear(0.4e6)}, {"smoothing": "quadratic", "epsilon": 0.05, "method": "snes_vi"}),
        ({"friction": quadratic_linear(0.4e6)}, {"smoothing": "quadratic", "epsilon": 0.05, "method": "condensed"}),
        ({"cohesion": TENSILE | {"beta": 0.7}}, {}),
    ],
)
def test_a_step_is_two_pieces_with_their_own_laws(laws: Table, solver: Table, key: str) -> None:
    table = model(8, 3e6, **solver)
    if "cohesion" in laws or "adhesion" in laws:
        table["boundary"]["press"] = LIFTED
    one, two = map(solved, both(table, laws, key))
    assert one.energy == pytest.approx(two.energy, rel=1e-9)
    np.testing.assert_allclose(one.u.x.array, two.u.x.array, atol=1e-9 * abs(two.u.x.array).max())
    for column in ("friction", "pressure"):
        whole, left = getattr(one.contact["sides"], column), getattr(two.contact["left"], column)
        np.testing.assert_allclose(whole[: len(left)], left, rtol=1e-6, atol=1e-6 * abs(left).max())


@KEYS
def test_paths_and_all_equilibria_follow_the_multiplier(key: str) -> None:
    law = quadratic_linear(1e7, 4e-6)
    scenes = [hvi.read_tables(table) for table in both(model(4, 6e6), {"friction": law}, key)]
    first, second = map(hvi.equilibria, scenes)
    assert first.complete
    assert len(first.solutions) == len(second.solutions) > 1
    assert [s.energy for s in first.solutions] == pytest.approx([s.energy for s in second.solutions], rel=1e-9)
    paths = [hvi.follow(scene, follow="exact") for scene in scenes]
    rows = [[(row.factor, row.energy) for row in path.rows] for path in paths]
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-8)
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


def test_a_rigid_block_is_torn_off_one_length_after_the_other() -> None:
    """Bonds of length l(x) that a rigid block stretches by d carry the sum of w t(d / l(x)), w being areas."""
    law = {"law": "graph", "points": [[0, 0], [1e-6, 2e5], [4e-6, 0]], "length_multiplier": "1 + 3*x"}
    table = block(8, 0.0, 0.0, law)
    table["material"] = STEEL | {"youngs_modulus": 2e17}
    for d in (0.5e-6, 3e-6, 7e-6):
        table["boundary"]["pull"] = {"on": ["left", "right"], "displacement": [d, "free"]}
        found = solved(table)
        x = np.linspace(0.0, 1.0, 9)
        tractions = np.interp(d / (1 + 3 * x), [0, 1e-6, 4e-6], [0, 2e5, 0])
        weights = np.r_[0.5, np.ones(7), 0.5] / 8
        np.testing.assert_allclose(found.contact["floor"].friction, tractions, rtol=1e-4, atol=1.0)
        assert found.resultant("floor")[0] == pytest.approx(-weights @ tractions, rel=1e-4)


SPACE = {
    "domain": {"shape": "box", "size": [1.0, 1.0, 0.5], "cells": [3, 3, 2]},
    "material": STEEL | {"model": "three_dimensional"},
    "boundary": {
        "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
        "pull": {"on": "right", "traction": [3e6, 2e5, 0.0]},
        "press": {"on": "top", "traction": [0.0, 0.0, -1e6]},
        "floor": {"on": "bottom", "contact": {"gap": 0.0}},
    },
    "solver": {},
}
SCENES = {
    "plane": (model(6, 3e6), quadratic_linear(1e6)),
    "falling": (model(4, 3e6), {"law": "graph", "points": [[0, 0], [9e-6, 1e6], [9e-3, 0]]}),
    "weakening": (
        model(4, 3e6),
        {"law": "exponential", "peak_traction": 1e6, "residual_traction": 2e5, "delta": DELTA},
    ),
    "space": (SPACE, quadratic_linear(1e6)),
    "interface": (two_blocks("rectangle", [1.0], [[5, 3], [4, 2]], "plane_stress"), quadratic_linear(1e6)),
}


@KEYS
@pytest.mark.parametrize("name", SCENES)
def test_a_constant_factor_is_another_unit(name: str, key: str) -> None:
    """Also in the certificate, in what is known of other equilibria, and in the estimated errors."""
    table, law = SCENES[name]
    place, part = ("interface", "seam") if name == "interface" else ("boundary", "floor")
    found = []
    for one in (law, times(law, key, 1e-3) | {key: "1e3 + 0*x"}):
        parts = table[place] | {part: table[place][part] | {"friction": one}}
        found.append(solved({**table, place: parts}, estimate=True))
    one, two = found
    assert two.energy == pytest.approx(one.energy, rel=1e-11)
    assert one.estimate is not None
    assert two.estimate is not None
    assert two.estimate.relative == pytest.approx(one.estimate.relative, rel=1e-7)
    assert two.certificate.inclusion == pytest.approx(one.certificate.inclusion, abs=1e-11)
    assert two.certificate.second_order == one.certificate.second_order


@KEYS
def test_models_from_python_give_functions(key: str) -> None:
    from own_mesh import steel_square

    square = steel_square()
    law = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=DELTA)
    kept = [e for e in square.effects if not isinstance(e, hvi.Friction)]
    given: tuple[Any, ...] = ("1 + x", lambda x: 1 + x[0])
    models = [hvi.Model(square.body, [*kept, hvi.Friction("floor", law, **{key: factor})]) for factor in given]
    one, two = (hvi.solve(made, estimate=False).energy for made in models)
    assert one == pytest.approx(two, rel=1e-12)


@pytest.mark.parametrize(
    ("formulas", "keys"),
    [
        (
            {"law": "quadratic_linear", "gamma1": "4e5*(1 + x)", "gamma2": "2e5*(1 + x)", "delta": "9e-6*(2 - x)"},
            quadratic_linear(4e5) | {"multiplier": "1 + x", "length_multiplier": "2 - x"},
        ),
        (
            {"law": "graph", "points": [[0, 0], ["1e-6*(1 + x)", 4e5], ["3e-6*(1 + x)", 1e5]]},
            {"law": "graph", "points": [[0, 0], [1e-6, 4e5], [3e-6, 1e5]], "length_multiplier": "1 + x"},
        ),
        (
            {"law": "tresca", "yield_traction": "2e5*x + 1", "multiplier": 2},
            {"law": "tresca", "yield_traction": 1.0, "multiplier": "4e5*x + 2"},
        ),
    ],
)
def test_formulas_in_the_place_of_numbers_are_multipliers(formulas: Table, keys: Table) -> None:
    one, two = (hvi.read_tables(model(6, 3e6, friction=law)) for law in (formulas, keys))
    wanted = hvi.solve(two, estimate=False).energy
    for scene in (one, pickle.loads(pickle.dumps(one)), hvi.read_tables(one.tables())):
        assert hvi.solve(scene, estimate=False).energy == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({"multiplier": "x - 0.5"}, "must be positive at every vertex"),
        ({"length_multiplier": "x - 0.5"}, "length_multiplier = 'x - 0.5' is .* must be positive at every vertex"),
        ({"length_multiplier": -1.0}, "must be positive"),
        ({"delta": "9e-6*(x - 0.5)"}, "must be positive at every vertex"),
        ({"delta": "9e-6*(x + q)"}, "'q'"),
        ({"delta": "0*x"}, "delta = 0.0 must be > 0"),
        ({"gamma1": "1e6*(1 + x)"}, "gamma2 is 500000 at .* another shape"),
        ({"delta": "9e-6"}, "without quotes"),
    ],
)
def test_what_is_refused(law: Table, said: str) -> None:
    with pytest.raises((hvi.InputError, ValueError), match=said):
        hvi.prepare(hvi.read_tables(model(4, friction=quadratic_linear(1e6) | law)))
