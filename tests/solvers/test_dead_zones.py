"""Bodies that a law holds, but only at a distance: at rest nothing resists their rigid motion."""

from __future__ import annotations

from typing import Any

import pytest
from enumeration import Floor, polyline
from scenes import STEEL, Table, block, displacement, energy, far, points, solved

PRESS = {"on": "top", "traction": [0.0, -1e6]}
PUSH = {"on": "left", "traction": [3e5, 0.0]}
GUIDE = {"on": "left", "displacement": [0.0, "free"]}


def graph(*points: tuple[float, float], one_sided: bool = False) -> Table:
    law: Table = {"law": "graph", "points": [list(p) for p in points]}
    return law | ({"one_sided": True} if one_sided else {})


def at_distance(width: float, peak: float, rise: float = 0.0) -> Table:
    """A support that the body meets at a distance, with a rise of some length or a jump."""
    return graph((0, 0), (width, 0), (width + rise, peak), one_sided=True)


DEAD = graph((0, 0), (1e-5, 0), (2e-5, 1e6))
JUMP = graph((0, 0), (1e-5, 0), (1e-5, 1e6))
SUPPORT = at_distance(1e-5, 1e7, 1e-5)


def square(cells: int = 4, solver: Table | None = None, **boundary: Table) -> Table:
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [cells, cells]},
        "material": dict(STEEL),
        "boundary": boundary,
        "solver": solver or {},
    }


def cube(solver: Table | None = None, **boundary: Table) -> Table:
    return {
        "domain": {"shape": "box", "size": [1.0, 1.0, 1.0], "cells": [2, 2, 2]},
        "material": STEEL | {"model": "three_dimensional"},
        "boundary": boundary,
        "solver": solver or {},
    }


def floor(law: Table | None = None, **more: Any) -> Table:
    return {"on": "bottom", "contact": {"gap": 0.0}} | ({"friction": law} if law else {}) | more


def pushed(law: Table, **solver: Any) -> Table:
    return square(4, solver, left=PUSH, top=PRESS, floor=floor(law))


SPACE_PUSH = {"on": "left", "traction": [3e5, 1e5, 0.0]}
SPACE_PRESS = {"on": "top", "traction": [0.0, 0.0, -1e6]}
SCENES: dict[str, Table] = {
    "friction": pushed(DEAD),
    "from beyond": pushed(DEAD, start=["3e-5", "0"]),
    "a jump": pushed(JUMP),
    "smoothed": pushed(DEAD, smoothing="quadratic", epsilon=0.01),
    "foundation": square(top=PRESS, wall=GUIDE, floor={"on": "bottom", "support": SUPPORT}),
    "in space": cube(left=SPACE_PUSH, top=SPACE_PRESS, floor=floor(DEAD)),
    "in space, turning": cube(
        left={"on": "left", "traction": [0.0, "4e5*(y - 0.3)", 0.0]}, top=SPACE_PRESS, floor=floor(DEAD)
    ),
    "three widths": square(
        5,
        left={"on": "left", "friction": graph((0, 0), (3e-5, 0), (5e-5, 2e6))},
        top={"on": "top", "traction": [2e5, -1e6]},
        right={"on": "right", "support": at_distance(3e-6, 3e6, 6e-6)},
        floor={"on": "bottom", "support": SUPPORT},
    ),
    "a wall on both sides": square(
        6,
        left={"on": "left", "contact": {"lower": -3e-5, "upper": 3e-5}},
        right={"on": "right", "traction": [-4e5, 0.0]},
        top=PRESS,
        floor={"on": "bottom", "support": SUPPORT},
    ),
    "stairs": pushed(graph((0, 0), (1e-5, 0), (1e-5, 2e5), (3e-5, 2e5), (4e-5, 1e6))),
    "glued at a distance": square(
        top={"on": "top", "traction": ["1e5*(1 - 2*x)", 1e5]},
        floor={"on": "bottom", "friction": DEAD, "adhesion": graph((0, 0), (1e-6, 0), (1e-5, 2e6))},
    ),
    "multigrid": pushed(DEAD, linear_solver="gamg"),
}


@pytest.mark.parametrize("name", SCENES)
def test_what_is_held_beyond_a_dead_zone_is_solved(name: str) -> None:
    found = solved(SCENES[name])
    assert found.solvability.state == "held"
    assert found.exit_code == 0, found.reason


@pytest.mark.parametrize(
    "law", [[(0, 0), (1e-5, 0), (2e-5, 1e6)], [(0, 0), (1e-5, 0), (1e-5, 1e6)]], ids=["rise", "jump"]
)
def test_the_solution_is_the_only_stationary_point_there_is(law: list[tuple[float, float]]) -> None:
    """By enumeration, without the package."""
    wanted = Floor(2, 3e5, 1e6, polyline(law), wall=False).stationary()
    assert len(wanted) == 1
    found = solved(block(2, 3e5, 1e6, graph(*law)))
    assert energy(found) == pytest.approx(wanted[0].energy, rel=1e-9)
    order = points(found)[:, [0, 1]]
    rows = (2 * order[:, 1] * 3 + 2 * order[:, 0]).round().astype(int)
    assert far(displacement(found), wanted[0].u[rows]) < 1e-7
