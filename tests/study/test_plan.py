"""What a study plans, and what it tells of its rows: fronts, sentences, shares."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scenes import model, quadratic_linear

from hvi_fenicsx import InputError, Model, read_tables
from hvi_fenicsx.study import plan
from hvi_fenicsx.study.errors import NORMS
from hvi_fenicsx.study.table import Certainty, Row, Study

LAW = quadratic_linear(1.0e6)


def scene(cells: int = 4, **keys: Any) -> Model:
    return read_tables(model(cells, **keys))


def planned(given: Model, *axes: str) -> plan.Plan:
    return plan.make(given, [plan.read_axis(text) for text in axes])


def cells(point: plan.Point) -> int:
    return int(point.scene.domain.cells[0])  # type: ignore[attr-defined]


def test_a_plan_is_the_product_of_its_axes_with_the_exact_law_on_every_mesh() -> None:
    made = planned(scene(4, friction=LAW), "mesh=2,8", "epsilon=1,exact")
    found = {(cells(p), p.scene.solver.epsilon) for p in made.points}
    assert found == {(2, 1.0), (2, None), (8, 1.0), (8, None), (4, None)}
    assert [cells(p) for p in made.reference] == [32, 16, 8]
    assert all(p.scene.solver.smoothing is None for p in made.reference)


def test_combinations_that_are_no_scene_are_left_out() -> None:
    made = planned(scene(4, friction=LAW), "method=auto,branch", "smoothing=chks", "epsilon=1")
    solvers = {(p.scene.solver.method, p.scene.solver.smoothing) for p in made.points}
    assert solvers == {("auto", None), ("auto", "chks")}
    assert "solves the law without smoothing" in made.left_out[0]


def test_a_plan_of_the_programs_own_varies_what_the_scene_has() -> None:
    with_law, without = planned(scene(8, friction=LAW)), planned(scene(8))
    assert {p.scene.solver.smoothing for p in with_law.points} == {None, "quadratic", "chks", "log_exp", "paper"}
    assert {p.scene.solver.smoothing for p in without.points} == {None}
    for made in (with_law, without):
        assert {cells(p) for p in made.points} == {2, 4, 8, 16}
        assert {"auto", "snes_vi"} <= {p.scene.solver.method for p in made.points}
        assert {p.mesh for p in made.points if p.degree == 2} >= {"8 × 8 cells", "16 × 16 cells"}
        assert made.reference[0].degree == 2


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["mash=1"], "did you mean 'mesh'"),
        (["mesh="], "needs values"),
        (["epsilon=-1"], "greater than 0"),
        (["degree=3"], "must be 2 or less"),
        (["method=newton"], "method"),
        (["mesh=0"], "number of cells"),
        (["mesh=8", "mesh=16"], "twice"),
        (["epsilon=1", "epsilon_absolute=1"], "leave one"),
        (["smoothing=chks"], "epsilon"),
    ],
)
def test_a_bad_plan_says_how_to_mend_it(given: list[str], words: str) -> None:
    with pytest.raises(InputError) as error:
        planned(scene(4, friction=LAW), *given)
    assert words in str(error.value).replace('"', "'")


def study_of(pairs: list[tuple[float, float]], own_error: float = 1e-4, **keys: Any) -> Study:
    """Rows by their seconds and errors; the first is the scene's own setting, the last the exact law."""
    empty = ("h", "smoothing", "epsilon", "epsilon_absolute", "energy", "iterations", "runs", "phases", "epsilon_part")
    setting = {"mesh": "4 × 4 cells", "degree": 1, "method": "auto", "linear_solver": "auto", "tolerance": 1e-8}
    found = {"dofs": 1, "converged": True, "reason": "certified", "exit_code": 0}
    rows = []
    for i, (seconds, error) in enumerate(pairs):
        own = {"point": str(i), "seconds": seconds, "errors": dict.fromkeys(NORMS, error)}
        varied = {name: values[i] for name, values in keys.items()}
        rows.append(Row(**{**dict.fromkeys(empty), **setting, **found, **own, **varied}))
    certain = dict.fromkeys(NORMS, Certainty(own_error, None))
    return Study(
        title="", rows=tuple(rows), own=rows[0], exact=rows[-1], certain=certain, reference=rows[-1], coarser=(),
        left_out=(), ranks=1,
    )  # fmt: skip


def test_the_front_holds_what_nothing_cheaper_is_as_accurate_as() -> None:
    pairs = [(10.0**s, 10.0**e) for s, e in np.random.default_rng(5).uniform(-3, 0, (40, 2))]
    found = study_of(pairs).front("energy_norm")
    better = [not any(s < t and e < r for s, e in pairs) for t, r in pairs]
    assert {int(r.point) for r in found} <= {i for i, good in enumerate(better) if good}
    assert all(a.errors["energy_norm"] > b.errors["energy_norm"] for a, b in pairwise(found))
    assert min(e for _, e in pairs) == pytest.approx(found[-1].errors["energy_norm"], rel=0.06)


def test_an_order_is_told_from_errors_that_the_reference_resolves() -> None:
    """On the finest mesh half of the error is the reference's: what remains falls too fast."""
    pairs = [(0.1, 0.04), (0.2, 0.02), (0.3, 0.005)]
    for own, order in ((0.005, 1.0), (1e-4, 2.0)):
        study = study_of(pairs, own, h=(0.4, 0.2, 0.1))
        assert study.order("u_t_l2", study.own) == pytest.approx(order)
