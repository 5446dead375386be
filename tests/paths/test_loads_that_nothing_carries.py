"""Paths of bodies with a motion that nothing resists: by statics, a load that works on it has no equilibrium."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from scenes import Table

import hvi_fenicsx as hvi

TIED: Table = {"tied": True}
RUBBING: Table = {"contact": {"gap": 0.0}, "friction": {"law": "tresca", "yield_traction": 1e6}}
FADING: Table = {"law": "exponential", "peak_traction": 1e6, "residual_traction": 0.0, "delta": 1e-6}
GLUED: Table = {"adhesion": FADING, "friction": FADING}


def on_rails(seam: Table, **loads: Table) -> hvi.Model:
    """Two blocks, one on the other, on rails along x."""
    block = {"shape": "rectangle", "size": [1.0, 0.5], "cells": [1, 1]}
    rails = {"rails": {"on": "lower.bottom", "displacement": ["free", 0.0]}}
    return hvi.read_tables(
        {
            "domain": {"lower": block, "upper": block | {"origin": [0.0, 0.5]}},
            "material": {
                "model": "plane_stress",
                "youngs_modulus": 2.15e11,
                "poisson_ratio": 0.29,
                "thermal_expansion": 1e-5,
            },
            "interface": {"seam": {"between": ["upper.bottom", "lower.top"], **seam}},
            "boundary": rails | {name: load for name, load in loads.items() if name != "body"},
            **{name: load for name, load in loads.items() if name == "body"},
        }
    )


PUSH: Table = {"on": "upper.left", "traction": [6e5, 0.0]}
BACK: Table = {"on": "lower.right", "traction": [-6e5, 0.0]}


@pytest.mark.parametrize("seam", [TIED, RUBBING, GLUED])
@pytest.mark.parametrize("to", [1.0, -1.0])
def test_bodies_that_slide_together_bear_no_load(seam: Table, to: float) -> None:
    """They are stiff but for the motion along the rails, whatever acts between them."""
    path = hvi.follow(on_rails(seam, push=PUSH), to=to)
    assert (path.end, path.peak_factor, path.uncertified) == ("escapes", 0.0, 0)
    assert path.reason == "no factor but 0 is borne by any equilibrium: a body comes off"


@pytest.mark.parametrize("scaled", ["push.traction", "rails.displacement", "body.temperature"])
def test_constant_loads_that_nothing_carries_leave_no_state(scaled: str) -> None:
    """At the factor 0 they act alone: the push is not balanced there, or at any factor."""
    loads = {"push": PUSH} | ({"back": BACK} if scaled == "push.traction" else {"body": {"temperature": 10.0}})
    path = hvi.follow(on_rails(TIED, **loads), scaled=[scaled])
    assert (path.end, len(path.rows)) == ("escapes", 0)
    assert path.reason == "no equilibrium bears the constant loads alone: a body comes off"


@pytest.mark.parametrize("scaled", [["push.traction", "back.traction"], ["body.temperature"], None])
def test_loads_that_balance_each_other_are_borne(scaled: list[str] | None) -> None:
    """The blocks carry them from one to the other; where they stand along the rails is free."""
    path = hvi.follow(on_rails(TIED, push=PUSH, back=BACK, body={"temperature": 10.0}), scaled=scaled)
    assert (path.end, path.peak_factor, path.uncertified) == ("reached", 1.0, 0)


def test_bodies_that_no_load_moves_are_borne_as_far_as_friction_holds() -> None:
    """Balanced pushes shear the seam; Tresca's friction bears 1e6 N/m there, so the factor 1e6 / 3e5."""
    path = hvi.follow(
        on_rails(RUBBING, push=PUSH, back=BACK, press=_pressed()), scaled=["push.traction", "back.traction"], to=5.0
    )
    assert path.end == "escapes"
    assert path.peak_factor == pytest.approx(1e6 / 3e5, rel=1e-6)


def test_heat_that_a_path_does_not_scale_does_no_work() -> None:
    """The rest: pulls times displacements, over a path that is straight from row to row."""
    softening = {"law": "graph", "points": [[0, 0], [1e-6, 1e6], [1e-5, 0]]}
    heat = {"one": {"region": "upper", "temperature": 0.1}}
    seam = {"contact": {"gap": 0.0}, "friction": softening}
    path = hvi.follow(
        on_rails(seam, push=PUSH, back=BACK, body=heat, press=_pressed()),
        scaled=["push.traction", "back.traction"],
        to=[1.5, 0.0, 5.0],
    )
    rows = [row for row in path.rows if row.event != "end"]
    work = sum(
        0.5 * (a.forces[part] + b.forces[part]) @ (b.displacements[part] - a.displacements[part])
        for a, b in pairwise(rows)
        for part in ("push", "back", "press")
    )
    assert len(rows) > 3
    assert rows[-1].work == pytest.approx(work, rel=1e-9)


def _pressed() -> dict[str, Any]:
    return {"on": "upper.top", "traction": [0.0, -1e7]}


def disk(**floor: Table) -> hvi.Model:
    """A disk on a floor, under its weight: it may roll and slide."""
    plane = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
    return hvi.read_tables(
        {
            "domain": {"shape": "disk", "radius": 0.1, "mesh_size": 0.04},
            "material": {"model": "plane_strain", "youngs_modulus": 2.1e9, "poisson_ratio": 0.3},
            "boundary": {"floor": {"on": "lower_arc", "contact": {"obstacle": plane}, **floor}},
            "body": {"force": [0.0, -1e6]},
        }
    )


@pytest.mark.parametrize("floor", [{}, {"friction": {"law": "linear_spring", "stiffness": 1e4}}])
def test_a_disk_that_rolls_has_a_path_to_its_equilibrium(floor: Table) -> None:
    """The spring carries nothing: the energy is that of the equilibrium without it."""
    path = hvi.follow(disk(**floor))
    assert (path.end, path.uncertified) == ("reached", 0)
    assert path.rows[-1].energy == pytest.approx(hvi.solve(disk()).energy, rel=1e-6)
