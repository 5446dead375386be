"""Bodies that roll before they rest: no active set on the way holds them, and none but contact ever does."""

from __future__ import annotations

import json
from typing import Any

import pytest
from mpi4py import MPI

from hvi_fenicsx import Model, read_tables, solve

WEIGHT = 8.0e4
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
    ("tresca", 0.08, 0.04, 2e4),
    ("drop", 0.08, 0.04, -2e4),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_body_that_rolls_comes_to_rest(case: tuple[str, float, float, float]) -> None:
    found = solve(rolling(*case))
    assert found.solvability.state == "held"
    assert found.exit_code == 0, found.reason


def answers() -> list[Any]:
    """Of one case: exit code and energy."""
    found = solve(rolling("tresca", 0.08, 0.04, 2e4))
    return [found.exit_code, found.examination.energy if found.examination else None]


if __name__ == "__main__":
    answered = answers()
    if MPI.COMM_WORLD.rank == 0:
        print(json.dumps(answered))
