"""Laws whose lengths change from place to place: against pieces with laws of their own, other lengths, closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import LIFTED, TENSILE, assert_equal, assert_same_equilibria, solved
from scenes import DELTA, STEEL, Table, block, model, quadratic_linear, two_blocks

import hvi_fenicsx as hvi

STEP = "2.5 if x < 0.5 else 1"


def longer(law: Table, factor: float) -> Table:
    """The law with all its lengths multiplied by a factor, stated by its parameters."""
    if law["law"] == "graph":
        return {**law, "points": [[factor * x, t] for x, t in law["points"]]}
    return {**law, **{key: factor * law[key] for key in law.keys() & {"delta", "reference_slip"}}}


def both(table: Table, laws: dict[str, Table]) -> tuple[Table, Table]:
    """A scene with laws of one length multiplier, a formula; and the same as two pieces, apart, with their own laws."""
    parts = dict(table["boundary"])
    floor = {key: value for key, value in parts.pop("floor").items() if key not in laws}
    middle = {"middle": floor | {"where": "abs(x - 0.5) < 0.25"}}
    sides = (
        floor | {"where": "abs(x - 0.5) > 0.25"} | {key: law | {"length_multiplier": STEP} for key, law in laws.items()}
    )
    left = floor | {"where": "x < 0.25"} | {key: longer(law, 2.5) for key, law in laws.items()}
    right = floor | {"where": "x > 0.75"} | laws
    return {**table, "boundary": parts | middle | {"sides": sides}}, {
        **table,
        "boundary": parts | middle | {"left": left, "right": right},
    }


@pytest.mark.parametrize(
    ("laws", "solver"),
    [
        ({"friction": quadratic_linear(0.4e6)}, {}),
        ({"friction": {"law": "graph", "points": [[0, 1e5], [3e-6, 1e5], [3e-6, 6e5]]}}, {}),
        ({"friction": quadratic_linear(0.4e6), "adhesion": TENSILE}, {"degree": 2}),
        ({"friction": quadratic_linear(0.4e6)}, {"smoothing": "quadratic", "epsilon": 0.05, "method": "snes_vi"}),
        ({"friction": quadratic_linear(0.4e6)}, {"smoothing": "quadratic", "epsilon": 0.05, "method": "condensed"}),
        ({"cohesion": TENSILE | {"beta": 0.7}}, {}),
    ],
)
def test_a_step_of_the_lengths_is_two_pieces_with_their_own_laws(laws: Table, solver: Table) -> None:
    table = model(8, 3e6, **solver)
    if "cohesion" in laws or "adhesion" in laws:
        table["boundary"]["press"] = LIFTED
    one, two = map(solved, both(table, laws))
    assert_equal(one, two, ("sides", "left"))


def test_paths_and_all_equilibria_follow_the_lengths() -> None:
    formula, pieces = (hvi.read_tables(t) for t in both(model(4, 6e6), {"friction": quadratic_linear(1e7, 4e-6)}))
    assert_same_equilibria(formula, pieces)
    paths = [hvi.follow(scene, follow="exact") for scene in (formula, pieces)]
    rows = [[(row.factor, row.energy) for row in path.rows] for path in paths]
    np.testing.assert_allclose(rows[0], rows[1], rtol=1e-8)
    assert all(row.certified for row in paths[0].rows)


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
KINDS = {
    "plane": lambda law: model(8, 3e6, friction=law),
    "falling": lambda law: model(4, 3e6, friction=law | {"law": "graph", "points": [[0, 0], [9e-6, 1e6], [9e-3, 0]]}),
    "weakening": lambda law: model(
        4, 3e6, friction=law | {"law": "exponential", "peak_traction": 1e6, "residual_traction": 2e5}
    ),
    "space": lambda law: _with(SPACE, "floor", law),
    "interface": lambda law: _with(two_blocks("rectangle", [1.0], [[5, 3], [4, 2]], "plane_stress"), "seam", law),
}


def _with(table: Table, part: str, law: Table) -> Table:
    key = "interface" if part == "seam" else "boundary"
    return {**table, key: table[key] | {part: table[key][part] | {"friction": law}}}


@pytest.mark.parametrize("kind", KINDS)
def test_a_constant_factor_is_another_length(kind: str) -> None:
    """Also in the certificate, in what is known of other equilibria, and in the estimated errors."""
    law = {key: value for key, value in quadratic_linear(1e6, DELTA).items() if kind in ("plane", "space", "interface")}
    number = law | ({"delta": 3.0 * DELTA} if kind != "falling" else {})
    formula = law | ({"delta": DELTA} if kind != "falling" else {}) | {"length_multiplier": "3 + 0*x"}
    tables = [KINDS[kind](number), KINDS[kind](formula)]
    if kind == "falling":
        tables[0]["boundary"]["floor"]["friction"]["points"] = [[0, 0], [27e-6, 1e6], [27e-3, 0]]
        tables[1]["boundary"]["floor"]["friction"]["points"] = [[0, 0], [9e-6, 1e6], [9e-3, 0]]
    one, two = (solved(table, estimate=True) for table in tables)
    assert two.energy == pytest.approx(one.energy, rel=1e-11)
    assert one.estimate is not None
    assert two.estimate is not None
    assert two.estimate.relative == pytest.approx(one.estimate.relative, rel=1e-7)
    assert two.certificate.inclusion == pytest.approx(one.certificate.inclusion, abs=1e-11)
    assert two.certificate.second_order == one.certificate.second_order


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


def test_models_from_python_give_lengths_as_functions() -> None:
    from own_mesh import steel_square

    square = steel_square()
    law = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=DELTA)
    energies = []
    for lengths in ("1 + x", lambda x: 1 + x[0]):
        kept = [e for e in square.effects if not isinstance(e, hvi.Friction)]
        friction = hvi.Friction("floor", law, length_multiplier=lengths)
        energies.append(hvi.solve(hvi.Model(square.body, [*kept, friction]), estimate=False).energy)
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        ({"length_multiplier": "x - 0.5"}, "length_multiplier = 'x - 0.5' is .* must be positive at every vertex"),
        ({"length_multiplier": -1.0}, "must be positive"),
        ({"delta": "9e-6"}, "without quotes"),
        ({"delta": "9e-6*(1 + x)"}, "must be a number .* length_multiplier"),
    ],
)
def test_what_is_refused(law: Table, said: str) -> None:
    with pytest.raises((hvi.InputError, ValueError), match=said):
        hvi.prepare(hvi.read_tables(model(4, friction=quadratic_linear(1e6) | law)))
