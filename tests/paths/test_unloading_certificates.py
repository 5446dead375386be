"""States after unloading are certified with the whole body: with memory, on a floor, in space, between two bodies."""

from __future__ import annotations

import numpy as np
import pytest
from runs import ROOT
from scenes import model

import hvi_fenicsx as hvi
from hvi_fenicsx import prepare
from hvi_fenicsx.certify import contact_state
from hvi_fenicsx.problem.vectors import turn
from hvi_fenicsx.reduced.condensation import Condensation

SOFT = "boundary.base.adhesion.points=[[0,0],[5e-6,1e6],[1e-4,0]]"


@pytest.mark.parametrize(
    ("demo", "changes"),
    [
        ("anchor_3d", ["domain.cells=[2,2,1]", SOFT, "path.to=[1.3,0.4]"]),
        pytest.param("scarf_joint", ["path.to=[1.0,0.3]"], marks=pytest.mark.long),
        pytest.param("single_lap", ["path.to=[5.0,0.3]"], marks=pytest.mark.long),
    ],
)
def test_every_row_is_certified_with_the_whole_body(demo: str, changes: list[str]) -> None:
    path = hvi.follow(hvi.read_scene(ROOT / "demos" / f"{demo}.toml", changes))
    assert len(path.rows) < 100
    assert path.run.states[-1].memory is not None
    assert path.examined == len(path.rows)
    assert path.uncertified == 0


def test_states_in_which_a_body_moves_without_load_are_certified() -> None:
    """Pressed against a wall above it, the body crosses the gap at the factor 0, and meets the wall bit by bit."""
    floor = {"lower": 0.0, "upper": 1e-6}
    law = {"law": "graph", "points": [[0, 0], [9e-6, 3e6], [9e-6, 1.5e6]]}
    table = {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [6, 6]},
        "material": {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "pull": {"on": "right", "traction": [6e6, 0.0]},
            "press": {"on": "top", "traction": [0.0, 5e5]},
            "floor": {"on": "bottom", "contact": floor, "friction": law},
        },
    }
    path = hvi.follow(hvi.read_tables(table))
    unloaded = [row for row in path.rows[1:] if abs(row.factor) < 1e-9]
    assert len(unloaded) > 2
    assert path.uncertified == 0


@pytest.mark.parametrize("demo", ["anchor_3d", "scarf_joint", "hertz"])
def test_a_force_inside_the_body_that_nothing_carries_is_seen(demo: str) -> None:
    """Whatever the unknowns of Γc are, the body follows them; with other loads inside it does not."""
    system = prepare(hvi.read_scene(ROOT / "demos" / f"{demo}.toml")).system
    condensed, rng = Condensation(system), np.random.default_rng(0)
    x = rng.normal(0.0, 1.0, condensed.problem.size)
    for factor, balanced in ((1.0, True), (0.9, False)):
        forces = contact_state.forces(system.problem, condensed.displacement(x, factor))
        reaction = system.load.duplicate()
        reaction.array[:] = forces.reaction.ravel()
        turn(reaction, system.rotation)
        carried = condensed.spread(condensed.problem.elastic @ x - condensed.problem.load(1.0))
        left = condensed.unbalanced(reaction, carried)
        size = float(np.linalg.norm(forces.load))
        assert (left < 1e-8 * float(np.linalg.norm(forces.reaction))) is balanced
        assert balanced or left > 0.01 * size


def test_a_smoothed_law_unloaded_to_nothing_is_loaded_again() -> None:
    """At no load a body on its floor is at rest, not off; without memory it comes to where it was."""
    table = model(4, pull=4e6, press=1e6, friction={"law": "graph", "points": [[0, 0], [2e-6, 3e6], [1.6e-5, 0]]})
    table["solver"] = {"smoothing": "quadratic", "epsilon": 0.05}
    scene = hvi.read_tables(table)
    path = hvi.follow(scene, to=[0.9, 0.0, 1.2], memory=False)
    assert path.end == "reached"
    assert path.uncertified == 0
    once = hvi.follow(scene, to=1.2, memory=False)
    assert path.displacement("pull")[-1] == pytest.approx(once.displacement("pull")[-1], rel=1e-9)


def slender() -> hvi.Model:
    """A nearly incompressible strip, a hundred times as long as high, that is pulled and lifts at one end."""
    law = {"law": "quadratic_linear", "gamma1": 1e4, "gamma2": 5e3, "delta": 9e-6}
    table = {
        "domain": {"shape": "rectangle", "size": [1.0, 0.01], "cells": [8, 2]},
        "material": {"model": "plane_strain", "youngs_modulus": 2.15e11, "poisson_ratio": 0.4999},
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "pull": {"on": "right", "traction": [1e6, 0.0]},
            "press": {"on": "top", "traction": [0.0, "-1e6*(1 - 1.2*x)"]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": law},
        },
        "solver": {"degree": 2},
    }
    return hvi.read_tables(table)


def test_a_path_of_a_slender_body_is_certified() -> None:
    """Rounding of its stiffness excuses stresses, but no net force; 37 of its rows had one of 7e-8 of the load."""
    path = hvi.follow(slender())
    assert path.run.states[-1].memory is not None
    assert len(path.rows) > 20
    assert path.uncertified == 0
