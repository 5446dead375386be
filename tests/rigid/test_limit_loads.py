"""Sliding, tipping, lift-off: the load factors of whole scenes against statics, and what a run does on either side.

Each on the rigid floor, and on a second body in its place whose mesh does not match.

Run as a script under mpirun this file prints what `told` says.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from typing import Any

import pytest
from mpi4py import MPI
from runs import LONG_RANKS, on_ranks
from scenes import NU, E, Table, quadratic_linear

from hvi_fenicsx import Model, prepare, read_tables, solve

SIZE = {2: (2.0, 1.0), 3: (2.0, 1.0, 1.0)}
STRONG = quadratic_linear(1.0e9)
W = 1.0e6
"""Pressure on the top, N/m²."""


def scene(dimension: int, cells: int, boundary: Table) -> Table:
    """A block of length 2 and height 1 (and depth 1) on a floor, pressed from above."""
    names = ["rectangle", "box"], ["plane_stress", "three_dimensional"]
    shape, model = (pair[dimension - 2] for pair in names)
    press = {"on": ["top"], "traction": [*[0.0] * (dimension - 1), -W]}
    return {
        "domain": {"shape": shape, "size": list(SIZE[dimension]), "cells": [cells * int(s) for s in SIZE[dimension]]},
        "material": {"model": model, "youngs_modulus": E, "poisson_ratio": NU},
        "boundary": {"press": press, **boundary},
    }


def on_a_body(table: Table) -> Table:
    """The same block on an elastic one that is held below, in the floor's place; it is larger and cut otherwise."""
    size, dimension = table["domain"]["size"], len(table["domain"]["size"])
    below = [-0.5] * (dimension - 1) + [-0.5]
    ground = {
        "shape": table["domain"]["shape"],
        "size": [*(s + 1.0 for s in size[:-1]), 0.5],
        "cells": [5, 3, 1][:dimension],
        "origin": below,
    }
    boundary = {
        name: {**effects, "on": [f"block.{side}" for side in effects["on"]]}
        for name, effects in table["boundary"].items()
        if name != "floor"
    }
    floor = {key: value for key, value in table["boundary"]["floor"].items() if key != "on"}
    held = {"base": {"on": ["ground.bottom"], "displacement": [0.0] * dimension}}
    return {
        **table,
        "domain": {"block": table["domain"], "ground": ground},
        "boundary": {**boundary, **held},
        "interface": {"floor": {"between": ["block.bottom", "ground.top"], **floor}},
    }


def sliding(dimension: int, push: float) -> Table:
    """The friction's floor has length (area) 2, the pushed side 1: λ = 2 γ / push, γ2 = 0.5e6, γ1 = 1e6."""
    friction = quadratic_linear(1.0e6)
    floor = {"on": ["bottom"], "contact": {"gap": 0.0}, "friction": friction}
    return scene(
        dimension, 2, {"floor": floor, "side": {"on": ["right"], "traction": [push, *[0.0] * (dimension - 1)]}}
    )


def tipping(dimension: int, push: float) -> Table:
    """About the front edge: weight W · 2 at arm 1 against push at the mean height 1/2: λ = 4 W / push."""
    floor = {"on": ["bottom"], "contact": {"gap": 0.0}, "friction": STRONG}
    return scene(
        dimension, 2, {"floor": floor, "side": {"on": ["right"], "traction": [push, *[0.0] * (dimension - 1)]}}
    )


def lifting(dimension: int, lift: float) -> Table:
    """Up along a wall, by adhesion of 0.5e6 at its peak and 0.25e6 left on the floor of 2: λ = (W + g) / lift."""
    glue = {"law": "graph", "points": [[0.0, 0.0], [9e-6, 0.5e6], [9e-6, 0.25e6]], "one_sided": True}
    rest = [0.0] * (dimension - 1)
    walls = {
        "wall": {"on": ["left"], "displacement": [0.0, *["free"] * (dimension - 1)]},
        "guide": {"on": ["right"], "displacement": [0.0, *["free"] * (dimension - 1)]},
    }
    if dimension == 3:
        walls["front"] = {"on": ["front"], "displacement": ["free", 0.0, "free"]}
    floor = {"on": ["bottom"], "contact": {"gap": 0.0}, "adhesion": glue}
    table = scene(dimension, 2, {"floor": floor, **walls})
    table["boundary"]["hook"] = {"on": ["top"], "traction": [*rest, lift]}
    return table


CASES = {
    "sliding": (sliding, "side", 1.0e6, 2.0e6, "translation along +x"),
    "tipping": (tipping, "side", 4.0e6, 4.0e6, "rotation about"),
    "lifting": (lifting, "hook", 1.25e6, 1.5e6, "translation along +"),
}
"""Scene by load, name of the load, its held and its peak value, direction of escape."""
LOAD = 0.7e6
FLOORS: dict[str, Callable[[Table], Table]] = {"rigid": lambda table: table, "body": on_a_body}


def scene_of(name: str, dimension: int, load: float, floor: str) -> Model:
    """A case at a load, on a floor."""
    return read_tables(FLOORS[floor](CASES[name][0](dimension, load)))


def told(comm: MPI.Comm) -> dict[str, Any]:
    """The load factors of each case at one load, and the states just around them."""
    found: dict[str, Any] = {}
    for floor, (name, case), dimension in itertools.product(FLOORS, CASES.items(), (2, 3)):
        _, load, held, peak, _ = case
        factors = prepare(scene_of(name, dimension, LOAD, floor), comm).load_factors(load)
        around = [held * (1 - 1e-6), held * (1 + 1e-6), peak * (1 - 1e-6), peak * (1 + 1e-6)]
        states = [prepare(scene_of(name, dimension, at, floor), comm).solvability.state for at in around]
        found[f"{name}-{dimension}-{floor}"] = {"held": factors.held, "peak": factors.peak, "states": states}
    return found


@pytest.fixture(scope="module", params=LONG_RANKS)
def answers(request: pytest.FixtureRequest) -> dict[str, Any]:
    """What `told` says on one, two and three ranks."""
    found: dict[str, Any] = told(MPI.COMM_SELF) if request.param == 1 else on_ranks(request.param, __file__)
    return found


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("floor", FLOORS)
def test_the_factors_are_those_of_statics_and_the_states_flip_there(
    name: str, dimension: int, floor: str, answers: dict[str, Any]
) -> None:
    _, _, held, peak, _ = CASES[name]
    found = answers[f"{name}-{dimension}-{floor}"]
    assert found["held"] == pytest.approx(held / LOAD, rel=1e-8)
    assert found["peak"] == pytest.approx(peak / LOAD, rel=1e-8)
    between = ["metastable", "metastable"] if held < peak else ["escapes", "held"]
    assert found["states"] == ["held", *between, "escapes"]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("floor", ["rigid", pytest.param("body", marks=pytest.mark.long)])
def test_a_run_is_certified_just_below_and_ends_without_solution_just_above(
    name: str, dimension: int, floor: str
) -> None:
    _, _, held, peak, words = CASES[name]
    below = solve(scene_of(name, dimension, held * (1 - 1e-4), floor))
    assert (below.exit_code, below.solvability.state) == (0, "held")
    above = solve(scene_of(name, dimension, peak * (1 + 1e-6), floor))
    assert (above.exit_code, above.solvability.state) == (3, "escapes")
    assert above.solvability.direction is not None
    assert above.solvability.direction.name.startswith(words)


@pytest.mark.parametrize("name", ["sliding", "lifting"])
@pytest.mark.parametrize("floor", ["rigid", pytest.param("body", marks=pytest.mark.long)])
def test_between_the_two_a_local_minimiser_is_certified(name: str, floor: str) -> None:
    _, _, held, _, _ = CASES[name]
    between = solve(scene_of(name, 2, 1.02 * held, floor))
    assert (between.exit_code, between.solvability.state) == (0, "metastable")
    assert between.examination is not None
    assert between.examination.certificate.second_order == "local minimiser"


if __name__ == "__main__":
    answered = told(MPI.COMM_WORLD)
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(answered))
