"""What a run knows about other equilibria: against closed forms, and against what moves without a change of energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scenes import STEEL, E, Table, block, model, quadratic_linear

from hvi_fenicsx import console, laws, read_tables
from hvi_fenicsx.certify.uniqueness import Uniqueness
from hvi_fenicsx.laws import Superpotential
from hvi_fenicsx.workflow import finish, prepare

TRESCA = {"law": "tresca", "yield_traction": 2e6}


def verdict(table: Table) -> Uniqueness:
    found = finish(prepare(read_tables(table)), estimating=False)
    assert found.converged
    assert found.uniqueness is not None
    return found.uniqueness


def bar(fall: float, **solver: Any) -> Table:
    """A bar of length 1 m, drawn off a bond that softens; all vertices move along it alone: it is E/1 m stiff."""
    rail = {"displacement": ["free", 0.0]}
    bond = {"law": "graph", "points": [[0.0, 0.0], [1e-6, 1e5], [1e-6 + 1e5 / fall, 0.0]]}
    return {
        "solver": solver,
        "domain": {"shape": "rectangle", "size": [1.0, 0.1], "cells": [4, 1]},
        "material": STEEL | {"poisson_ratio": 0.0},
        "boundary": {
            "left": {"on": "left", "displacement": [-1.2e-6, 0.0]},
            "top": {"on": "top"} | rail,
            "bottom": {"on": "bottom"} | rail,
            "bond": {"on": "right", "adhesion": bond},
        },
    }


def cube(friction: Table) -> Table:
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [1, 1, 1]},
        "material": STEEL | {"model": "three_dimensional"},
        "boundary": {
            "press": {"on": "top", "traction": [1e5, 0.0, -1e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": friction},
        },
    }


@pytest.mark.parametrize(
    "table",
    [
        model(2),
        model(2, friction=TRESCA),
        model(2, friction=TRESCA, smoothing="chks", epsilon=1e-3),
        block(2, push=1e5, friction=TRESCA),
        cube(TRESCA),
        block(2, push=1e5, friction={"law": "linear_spring", "stiffness": 1e11}),
    ],
    ids=["contact", "Tresca", "smoothed", "held by friction", "in space", "held by springs"],
)
def test_where_laws_rise_and_motions_are_held_there_is_no_other(table: Table) -> None:
    assert verdict(table).state == "unique"


def test_a_body_that_slides_freely_has_others_of_the_same_energy() -> None:
    found = verdict(block(2, push=0.0))
    assert found.state == "lowest"
    assert "translation along x" in found.why


@pytest.mark.parametrize(("share", "state"), [(0.999, "unique"), (1.001, "lowest")])
def test_a_bar_is_as_stiff_as_its_bond_may_fall(share: float, state: str) -> None:
    assert verdict(bar(share * E)).state == state


@pytest.mark.parametrize("smoothing", ["chks", "log_exp"])
@pytest.mark.parametrize(("share", "state"), [(0.97, "unique"), (1.01, "unknown")])
def test_a_bar_is_as_stiff_as_a_smoothed_drop_may_fall(smoothing: str, share: float, state: str) -> None:
    """A jump J falls by J²/(4ε) at most, p'' being at most 1/4; the bound of the tails adds up to 3 %."""
    epsilon = 1e5**2 / (4.0 * share * E)
    assert verdict(bar(np.inf, smoothing=smoothing, epsilon_absolute=epsilon)).state == state


def test_the_papers_model_problem_has_no_other_equilibrium() -> None:
    """The law is smoothed as in the paper, and weak for the body."""
    table = model(16, friction=quadratic_linear(1e3), smoothing="paper", epsilon_absolute=0.1)
    assert verdict(table).state == "unique"


def test_a_drop_leaves_it_open_and_the_terminal_says_so() -> None:
    found = finish(prepare(read_tables(model(8, 6e6, 1e6, quadratic_linear(3e6)))), estimating=False)
    lines = [line for line in console.outcome(found) if line.startswith("other equilibria: unknown")]
    assert len(lines) == 1
    assert "boundary.floor: the law's traction drops" in lines[0]
    assert "hvi equilibria" in lines[0]


LAWS: list[tuple[dict[str, Any], float]] = [
    (TRESCA, 0.0),
    ({"law": "linear_spring", "stiffness": 3e9}, 0.0),
    ({"law": "graph", "points": [[0, 1e5], [1e-6, 2e5], [3e-6, 1e5], [7e-6, 0]]}, 5e10),
    ({"law": "exponential", "peak_traction": 3e5, "residual_traction": 1e5, "delta": 2e-6}, 1e11),
    (quadratic_linear(1e6), np.inf),
]


@pytest.mark.parametrize(("table", "fall"), LAWS, ids=[table["law"] for table, _ in LAWS])
def test_the_steepest_fall_of_a_law_in_all_units(table: dict[str, Any], fall: float) -> None:
    given = dict(table)
    law: Superpotential = laws.create(given.pop("law"), given)
    assert law.is_convex == (fall == 0.0)
    for one, unit in ((law, 1.0), (law.scaled(1e-5, 1e6), 1e-11)):
        assert one.steepest_fall == pytest.approx(fall * unit, rel=1e-12)


def test_tied_bodies_that_nothing_holds_may_move_as_a_whole() -> None:
    sides = {
        "lower": {"shape": "rectangle", "size": [1.0, 0.1], "cells": [10, 2]},
        "upper": {"shape": "rectangle", "size": [1.0, 0.1], "cells": [10, 2], "origin": [0.0, 0.1]},
    }
    found = verdict(
        {
            "domain": sides,
            "material": {**STEEL, "thermal_expansion": 1e-5},
            "body": {"warm": {"region": "upper", "temperature": 100.0}},
            "interface": {"seam": {"between": ["upper.bottom", "lower.top"], "tied": True}},
        }
    )
    assert found.state == "lowest"
    assert "rotation about" in found.why
