"""An obstacle that a force presses: against closed forms, and against the obstacle held where the force moved it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from runs import ROOT
from scenes import Table

import hvi_fenicsx as hvi
from hvi_fenicsx.errors import ExitCode

E, AREA, HEIGHT, GAP = 1e9, 0.12, 0.5, 2e-4
PLATE = {"point": [0.0, 0.0, HEIGHT + GAP], "normal": [0.0, 0.0, -1.0], "force": [0.0, 0.0, -3e4]}
HARDENING = {"law": "graph", "points": [[0, 0], [2e-6, 2e5], [8e-6, 4e5]]}


def block(modulus: float = E, **boundary: Table) -> Table:
    table: Table = {
        "domain": {"shape": "box", "size": [0.4, 0.3, HEIGHT], "cells": [2, 1, 2]},
        "material": {"model": "three_dimensional", "youngs_modulus": modulus, "poisson_ratio": 0.0},
        "boundary": {"lid": {"on": "top", "contact": {"obstacle": dict(PLATE)}}, **boundary},
    }
    return table


def solved(table: Table, **options: Any) -> hvi.Solution:
    found = hvi.solve(hvi.read_tables(table), **options)
    assert found.converged, found.reason
    return found


BASE = {"on": "bottom", "displacement": [0.0, 0.0, 0.0]}


def test_a_plate_under_a_force_goes_down_by_the_gap_and_the_compression_of_the_column() -> None:
    found = solved(block(base=BASE))
    assert found.obstacle is not None
    np.testing.assert_allclose(found.obstacle.displacement, [0.0, 0.0, -GAP - 3e4 * HEIGHT / (E * AREA)], rtol=1e-9)
    np.testing.assert_allclose(found.resultant("lid"), PLATE["force"], rtol=1e-8, atol=1e-4)
    np.testing.assert_allclose(found.contact["lid"].pressure, 3e4 / AREA, rtol=1e-7)
    assert found.uniqueness is not None
    assert found.uniqueness.state == "unique"
    assert "at every position of the obstacle" in found.uniqueness.why


def test_a_rigid_block_between_a_plate_and_springs_goes_down_by_force_over_stiffness() -> None:
    """The springs' stiffness falls to a half at 1 mm, where they bear 24 kN."""
    springs = {"law": "graph", "points": [[0, 0], [1e-3, 2e5], [1e-2, 1.1e6]], "one_sided": True}
    smooth = {side: {"on": side, "displacement": way} for side, way in _HELD.items()}
    found = solved(block(modulus=1e16, base={"on": "bottom", "support": springs}, **smooth))
    assert found.obstacle is not None
    pressed = 1e-3 + (3e4 - 2.4e4) / (1e8 * AREA)
    assert found.obstacle.displacement[2] == pytest.approx(-GAP - pressed, rel=1e-6)


_HELD = {"left": [0.0, "free", "free"], "front": ["free", 0.0, "free"]}


def test_a_disk_is_pressed_by_a_plate_as_hertz_says() -> None:
    """The peak of the pressure is sqrt(F E* / (π R)): no displacement is given, only the force."""
    scene = hvi.read_scene(ROOT / "demos/hertz.toml", ["domain.mesh_size=0.01", "domain.mesh_size_below=0.6e-3"])
    table = scene.tables()
    load = table["boundary"].pop("top")
    table["boundary"]["held"] = {"on": load["on"], "displacement": [0.0, 0.0]}
    plate = {"point": [0.0, 0.0], "normal": [0.0, 1.0], "force": [0.0, 4e3]}
    table["boundary"]["floor"] |= {"contact": {"obstacle": plate}}
    found = solved(table)
    peak = float(found.contact["floor"].pressure.max())
    assert peak == pytest.approx(np.sqrt(4e3 * 1e7 / (1 - 0.3**2) / (np.pi * 0.1)), rel=0.02)


@pytest.mark.parametrize("degree", [1, 2])
def test_the_solution_is_that_with_the_obstacle_held_where_the_force_moved_it(degree: int) -> None:
    """A roller along an oblique direction on a block with friction that is loaded from the side."""
    way = np.array([0.2, -1.0]) / np.hypot(0.2, 1.0)
    roller = {"shape": "sphere", "center": [0.5, 40.5002], "radius": 40.0, "direction": [-0.2, 1.0]}
    table: Table = {
        "domain": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [16, 8]},
        "material": {"model": "plane_strain", "youngs_modulus": E, "poisson_ratio": 0.3},
        "boundary": {
            "base": {"on": "bottom", "displacement": [0.0, 0.0]},
            "side": {"on": "left", "where": "y > 0.2 and y < 0.3", "traction": [3e5, 0.0]},
            "top": {
                "on": "top",
                "where": "x > 0.2 and x < 0.8",
                "contact": {"obstacle": roller | {"force": (5e5 * way).tolist()}},
                "friction": HARDENING,
            },
        },
        "solver": {"degree": degree},
    }
    found = solved(table)
    assert found.obstacle is not None
    held = roller | {"displacement": found.obstacle.displacement.tolist()}
    table["boundary"]["top"]["contact"]["obstacle"] = held
    again = solved(table, estimate=False)
    assert again.energy == pytest.approx(found.energy, rel=1e-9)
    top = again.contact["top"]
    assert np.sum(top.pressure * top.weight) == pytest.approx(5e5, rel=1e-6)


def roller(cells: int, moved: dict[str, list[float]]) -> Table:
    """A roller on a block of twice as many cells along x."""
    shape = {"shape": "sphere", "center": [0.5, 4.5002], "radius": 4.0, "direction": [0.0, 1.0]}
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [2 * cells, cells]},
        "material": {"model": "plane_strain", "youngs_modulus": E, "poisson_ratio": 0.3},
        "boundary": {
            "base": {"on": "bottom", "displacement": [0.0, 0.0]},
            "top": {"on": "top", "where": "x > 0.2 and x < 0.8", "contact": {"obstacle": shape | moved}},
        },
    }


GLIDES = {side: {"on": side, "displacement": way} for side, way in _HELD.items()}


@pytest.mark.parametrize(("load", "way"), [(1e3, "-z"), (1e5, "+z")])
def test_a_body_that_only_a_load_holds_against_the_plate_escapes(load: float, way: str) -> None:
    """The smaller one of both forces cannot hold the larger one: proven before anything is solved."""
    table = block(**GLIDES, base={"on": "bottom", "traction": [0.0, 0.0, load / AREA]})
    found = hvi.solve(hvi.read_tables(table))
    assert found.exit_code == ExitCode.NO_SOLUTION
    assert found.solvability.direction is not None
    assert found.solvability.direction.name == f"translation along {way}, together with the obstacle of lid.contact"


def test_the_force_on_the_plate_has_the_limit_load_of_the_bed() -> None:
    """The bed bears 48 kN at its peak and 24 kN beyond it, the plate presses with 30 kN."""
    bed = {"law": "graph", "points": [[0, 0], [1e-6, 4e5], [1e-6, 2e5]], "one_sided": True}
    table = block(**GLIDES, base={"on": "bottom", "support": bed})
    prepared = hvi.prepare(hvi.read_tables(table))
    assert prepared.solvability.state == "metastable"
    for factors in (prepared.load_factors("lid"), prepared.load_factors()):
        assert (factors.held, factors.peak) == pytest.approx((24 / 30, 48 / 30), rel=1e-9)
    table["boundary"]["lid"]["contact"]["obstacle"]["force"] = [0.0, 0.0, -4.9e4]
    assert hvi.solve(hvi.read_tables(table)).exit_code == ExitCode.NO_SOLUTION


@pytest.mark.parametrize(
    ("obstacle", "said"),
    [
        ({"force": [0.0, 0.0, 3e4]}, "away from the body"),
        ({"displacement": [0.0, 0.0, -1e-4]}, "give one of them"),
        ({"force": [0.0, 0.0, 0.0]}, "is zero"),
        ({"force": [0.0, -3e4]}, "in 3D it has 3"),
    ],
)
def test_forces_that_make_no_sense_are_refused(obstacle: Table, said: str) -> None:
    table = block(base=BASE)
    table["boundary"]["lid"]["contact"]["obstacle"] |= obstacle
    with pytest.raises((hvi.InputError, ValueError), match=said):
        hvi.solve(hvi.read_tables(table))


@pytest.mark.parametrize("command", [hvi.follow, hvi.equilibria])
def test_other_commands_say_what_to_do(command: Any) -> None:
    with pytest.raises(hvi.InputError, match="give the obstacle the displacement"):
        command(hvi.read_tables(block(base=BASE)))
