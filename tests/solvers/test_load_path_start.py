"""Where laws soften, or a state is metastable, `auto` takes the equilibrium of the load path, or says where it ends."""

from __future__ import annotations

import re

import pytest
from scenes import Table, solved

MOST_STEPS = 65
"""Newton steps where a load path ends: those before it, and three further starts of at most 15."""
STRENGTH = 220.591e3
"""Of the bar, N/m: Yuan and Teng's closed form."""


def bar(pull: float, cells: int = 95) -> Table:
    """A bar glued along its length and pulled at one end."""
    return {
        "domain": {"shape": "rectangle", "size": [0.190, 0.001], "cells": [cells, 1]},
        "material": {"model": "plane_stress", "youngs_modulus": 4.224e10, "poisson_ratio": 0.0},
        "boundary": {
            "pull": {"on": "right", "traction": [pull / 0.001, 0.0]},
            "glue": {
                "on": "bottom",
                "contact": {"lower": 0.0, "upper": 0.0},
                "friction": {"law": "graph", "points": [[0, 0], [3.4e-5, 7.2e6], [1.6e-4, 0]]},
            },
        },
    }


def strip(**solver: object) -> Table:
    """An arm of a double cantilever whose end is lifted until a third of the glue is broken."""
    glue = {"law": "graph", "points": [[0, 0], [4e-6, 5e6], [20e-6, 0]], "one_sided": True}
    return {
        "domain": {"shape": "rectangle", "size": [0.15, 0.005], "cells": [75, 3]},
        "material": {"model": "plane_strain", "youngs_modulus": 7.0e10, "poisson_ratio": 0.3},
        "boundary": {
            "lifted": {"on": "left", "displacement": ["free", 1.0e-3]},
            "far": {"on": "right", "displacement": [0.0, 0.0]},
            "glue": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": glue},
        },
        "solver": solver,
    }


def anchor(load: float) -> Table:
    """A block that is pulled off its base in space: adhesion softens, friction acts on the length of the slip."""
    glue = {"law": "graph", "points": [[0, 0], [5e-6, 1e6], [1e-4, 0]], "one_sided": True}
    friction = {"law": "quadratic_linear", "gamma1": 1.0e6, "gamma2": 0.5e6, "delta": 2e-5}
    return {
        "domain": {"shape": "box", "size": [0.2, 0.2, 0.1], "cells": [3, 3, 2]},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.1e11, "poisson_ratio": 0.3},
        "boundary": {
            "pull": {"on": "top", "traction": [0.0, 0.0, f"{load}*0.6e6*(1 + (x - 0.1)/0.3)"]},
            "base": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": glue, "friction": friction},
        },
    }


def said_factor(reason: str) -> float:
    match = re.search(r"no equilibrium on the loading path: at the factor ([\d.]+)", reason)
    assert match is not None
    return float(match[1])


@pytest.mark.parametrize("load", [pytest.param(1.05, marks=pytest.mark.long), 2.0])
def test_above_its_strength_the_path_of_a_bar_says_which_load_it_bears(load: float) -> None:
    found = solved(bar(load * STRENGTH))
    assert found.exit_code == 4
    assert said_factor(found.solve_result.reason) * load == pytest.approx(1.0, rel=1e-3)
    assert found.solve_result.counts.newton < MOST_STEPS


def test_above_its_strength_in_space_with_friction_on_a_length_the_curve_says_which_load_is_borne() -> None:
    found = solved(anchor(1.5))
    assert found.exit_code == 4
    assert found.solve_result.counts.newton < MOST_STEPS
    borne = said_factor(found.solve_result.reason) * 1.5
    assert borne == pytest.approx(1.43225, rel=1e-5)  # the stable path of docs/paths.md
    assert solved(anchor(0.999 * borne)).converged


def test_just_below_its_strength_the_bar_is_solved() -> None:
    found = solved(bar(0.995 * STRENGTH))
    assert found.converged


def test_a_peeled_strip_is_the_same_as_by_the_branch_iteration_in_few_newton_steps() -> None:
    path, branch = solved(strip()), solved(strip(method="branch"))
    assert path.converged
    assert branch.converged
    assert path.examination.energy == pytest.approx(branch.examination.energy, rel=1e-10)
    assert path.solve_result.counts.newton < 20 < branch.solve_result.counts.newton


def test_an_equilibrium_to_which_loading_leads_by_a_jump_only_is_found_and_told() -> None:
    """A scene of the attack (20261201 #463): the curve of equilibria turns back at 0.70 of the load."""
    law = [[0, 0], [0.014837, 375810], [0.098774, 886090], [0.12308, 127480], [0.12308, -904350]]
    table: Table = {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [1, 1, 2]},
        "material": {"model": "three_dimensional", "youngs_modulus": 1.25e6, "poisson_ratio": 0.29},
        "boundary": {
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": {"law": "graph", "points": law}},
            "wall": {"on": "left", "displacement": [0.0, "free", "free"]},
            "pull": {"on": "right", "traction": [-599488.0, 0.0, 0.0]},
            "press": {"on": "top", "traction": [0.0, 0.0, -3474740.0]},
        },
    }
    found, resting = solved(table), solved(table | {"solver": {"start": "resting", "method": "branch"}})
    assert found.converged
    assert "loading leads to it by a jump, if at all: at the factor 0.703226" in found.reason
    assert found.examination.energy == pytest.approx(resting.examination.energy, rel=1e-10)
