"""Energies of separation that differ by mode: equilibria in closed form are found; none is the lowest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import hvi_fenicsx as hvi

Table = dict[str, Any]
BETA, RATIO, EXPONENT, SHARE, TRACTION = 0.7, 2.0, 2.0, 0.5, 8.0e6
POINTS = [[0, 0], [2e-6, 1.2e7], [2e-6, 4e6], [1e-5, 1.6e7]]
CRITERIA = {
    "benzeggagh_kenane": 1.0 + (RATIO - 1.0) * SHARE**EXPONENT,
    "power_law": ((1.0 - SHARE) ** EXPONENT + (SHARE / RATIO) ** EXPONENT) ** (-1.0 / EXPONENT),
}


def scene(criterion: str, poisson_ratio: float = 0.0) -> hvi.Model:
    """A square under a uniform stress. Without contraction all its bonds have one share of the slip, and one m g(δ)."""
    strength = CRITERIA[criterion] * TRACTION
    pull, drag = strength * np.sqrt(1.0 - SHARE), BETA * strength * np.sqrt(SHARE)
    mixed: Table = {"mixity": criterion, "energy_ratio": RATIO, "exponent": EXPONENT}
    table: Table = {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [2, 2]},
        "material": {"model": "plane_stress", "youngs_modulus": 2e11, "poisson_ratio": poisson_ratio},
        "boundary": {
            "top": {"on": "top", "traction": [drag, pull]},
            "right": {"on": "right", "traction": [0.0, drag]},
            "left": {"on": "left", "traction": [0.0, -drag]},
            "glue": {"on": "bottom", "cohesion": {"law": "graph", "points": POINTS, "beta": BETA, **mixed}},
        },
    }
    return hvi.read_tables(table)


def lengths(found: hvi.Solution) -> np.ndarray:
    """δ at the vertices, m."""
    assert found.examination is not None
    (state,) = (s for s in found.examination.states if s.surface.part == "glue")
    opening, slip = np.maximum(-state.normal, 0.0), state.slip[:, 0]
    return np.asarray(np.hypot(opening, BETA * slip) * found.problem.scales.displacement)


@pytest.mark.parametrize("criterion", ["power_law", pytest.param("benzeggagh_kenane", marks=pytest.mark.long)])
def test_both_uniform_equilibria_are_found_without_a_proof(criterion: str) -> None:
    """Each vertex is on the rising branch before the drop, or on that behind it."""
    found = hvi.equilibria(scene(criterion))
    assert (found.complete, found.proven, found.lower_bound) == (False, False, None)
    assert "there may be more" in found.reason
    assert all(s.exit_code == 0 and s.examination.certificate.mixity <= 1e-8 for s in found.solutions)
    for wanted in (2e-6 * 8.0 / 12.0, 2e-6 + (TRACTION - 4e6) / 1.5e12):
        assert any(np.allclose(lengths(s), wanted, rtol=1e-6) for s in found.solutions)
    assert set(found.kinds) == {"undecided"}


@pytest.mark.long
def test_what_a_run_finds_is_among_them() -> None:
    """With contraction the bonds are not alike; of a run one breaks, which neither loads nor fronts lead to."""
    one = lengths(hvi.solve(scene("benzeggagh_kenane", 0.3)))
    found = hvi.equilibria(scene("benzeggagh_kenane", 0.3))
    assert np.count_nonzero(one > 2e-6) == 1
    assert sum(np.allclose(lengths(s), one, rtol=1e-6) for s in found.solutions) == 1
    assert len(found.solutions) > 1


def test_no_energy_is_called_the_lowest() -> None:
    found = hvi.equilibria(scene("power_law"), lowest=True)
    assert (found.solutions, found.proven, found.lower_bound) == ((), False, None)
    assert "depends on the mode" in found.reason
