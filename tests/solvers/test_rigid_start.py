"""Bodies that roll before they rest: no active set on the way holds them, and none but contact ever does."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from dolfinx import fem
from mpi4py import MPI
from runs import on_ranks
from scenes import context_of

from hvi_fenicsx import Model, prepare, read_tables, solve
from hvi_fenicsx.solvers.resting_start import at_rest

WEIGHT = 8.0e4
FLOOR = {"point": [0.0, 0.0], "normal": [0.0, 1.0]}
LAWS: dict[str, Any] = {
    "none": {},
    "tresca": {"friction": {"law": "tresca", "yield_traction": 1e3}},
    "drop": {"friction": {"law": "quadratic_linear", "gamma1": 1e4, "gamma2": 5e3, "delta": 1e-6}},
}


def rolling(law: str, size: float, below: float, push: float) -> Model:
    """A half-disk on a floor, its flat top guided upright, pushed to the side: two rigid motions, both free."""
    return read_tables(
        {
            "domain": {"shape": "half_disk", "radius": 0.5, "mesh_size": size, "mesh_size_below": below},
            "material": {"model": "plane_stress", "youngs_modulus": 2.1e11, "poisson_ratio": 0.3},
            "body": {"force": [push, -WEIGHT]},
            "boundary": {
                "held": {"on": ["top"], "displacement": [0.0, "free"]},
                "floor": {
                    "on": ["arc"],
                    "contact": {"obstacle": {"point": [0.0, 0.0], "normal": [0.0, 1.0]}},
                    **LAWS[law],
                },
            },
        }
    )


CASES = [
    ("none", 0.06, 0.01, 0.0),
    ("none", 0.1, 0.02, 2e4),
    ("none", 0.15, 0.015, -2e4),
    ("tresca", 0.08, 0.04, 2e4),
    ("tresca", 0.12, 0.02, -2e4),
    ("drop", 0.12, 0.01, 2e4),
    ("drop", 0.08, 0.04, -2e4),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_body_that_rolls_comes_to_rest(case: tuple[str, float, float, float]) -> None:
    found = solve(rolling(*case))
    assert found.solvability.state == "held"
    assert found.exit_code == 0, found.reason


def test_a_body_at_rest_is_borne_by_as_many_vertices_as_it_has_motions() -> None:
    """Their reactions push, and carry all of its weight."""
    prepared = prepare(rolling("none", 0.1, 0.02, 2e4), MPI.COMM_SELF)
    system, rested = prepared.system, at_rest(context_of(prepared), [], lambda _: [], 1e-10)
    assert rested is not None
    residual = system.load.duplicate()
    system.equations.residual(rested[0], residual, [])
    forces = residual.array_r[system.jacobian.rows.dofs]
    bearing = np.flatnonzero(np.abs(forces) > 1e-6 * np.max(np.abs(forces)))
    assert len(bearing) == 2
    assert np.all(forces[bearing] > 0)
    field = fem.Function(system.problem.space)
    field.x.array[1::2] = 1.0
    lift = system.unknowns(field)
    carried = forces[bearing] @ lift.array_r[system.jacobian.rows.dofs[bearing]]
    assert carried == pytest.approx(-float(system.load.dot(lift)), rel=1e-8)


def answers() -> list[Any]:
    """Of one case: exit code and energy."""
    found = solve(rolling("tresca", 0.08, 0.04, 2e4))
    return [found.exit_code, found.examination.energy if found.examination else None]


@pytest.mark.long
def test_on_two_ranks_it_rests_where_it_does_on_one() -> None:
    one, two = answers(), on_ranks(2, __file__)
    assert one[0] == two[0] == 0
    assert two[1] == pytest.approx(one[1], rel=1e-9)


if __name__ == "__main__":
    answered = answers()
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(answered))
