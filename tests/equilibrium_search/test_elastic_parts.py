"""By how much displacements differ that rigid motions move alike: by hand, and against forces drawn at random."""

from __future__ import annotations

import condensed
import numpy as np
import pytest

from hvi_fenicsx.equilibrium_search.condensed_form import scalar_problem
from hvi_fenicsx.equilibrium_search.rigid_balance import ElasticParts, RigidBalance
from hvi_fenicsx.equilibrium_search.scalar_problem import ScalarProblem

PEAK, SPRING, LOAD, SIZE = 1.0, 5.0, 0.05, 9
BOND = condensed.graph([[0.0, 0.0], [0.1, PEAK], [0.1, 0.3]])


def row() -> ScalarProblem:
    """Points in a row, pulled at the last one, that only bonds hold."""
    forces = np.eye(SIZE)[-1] * LOAD
    bonds = condensed.bonds(BOND, list(range(SIZE)))
    return scalar_problem(condensed.problem(condensed.chain(SIZE, SPRING), forces, bonds))


@pytest.mark.parametrize("known", range(SIZE))
def test_a_point_in_a_row_is_near_to_the_next(known: int) -> None:
    """The spring between two points bears what bonds on the shorter side do; least squares know half of that."""
    low, high = np.full(SIZE, -50.0), np.full(SIZE, 50.0)
    low[known], high[known] = -0.2, 0.2
    ends = RigidBalance(row()).tightened(low, high)
    assert ends is not None
    assert np.all((ends[0] >= low) & (ends[1] <= high))
    for i in {max(known - 1, 0), min(known + 1, SIZE - 1)} - {known}:
        bonds = min(max(i, known), SIZE - max(i, known))
        stretch = (2.0 * bonds * PEAK + LOAD) / SPRING
        assert ends[0][i] >= -0.2 - stretch
        assert ends[1][i] <= 0.2 + stretch


def test_differences_hold_for_all_forces_and_are_reached() -> None:
    random = np.random.default_rng(0)
    flexibility, middle, half = random.normal(size=(6, 6)), random.normal(size=6), random.uniform(size=6)
    rows = flexibility * half
    parts = ElasticParts(middle=flexibility @ middle, rows=rows, error=np.zeros(6))
    chosen = np.array([0, 2, 5])
    most = parts.differences(chosen)
    for a, i in enumerate(chosen):
        for b, j in enumerate(chosen):
            drawn = (flexibility[i] - flexibility[j]) @ (middle + half * random.uniform(-1.0, 1.0, (500, 6))).T
            corner = (flexibility[i] - flexibility[j]) @ (middle + half * np.sign(rows[i] - rows[j]))
            assert drawn.max() <= most[a, b] + 1e-12
            assert most[a, b] == pytest.approx(corner, abs=1e-12)


def test_what_the_flexibility_is_off_counts_for_both_parts() -> None:
    parts = ElasticParts(middle=np.array([1.0, 3.0]), rows=np.zeros((2, 2)), error=np.array([0.25, 0.5]))
    np.testing.assert_allclose(parts.differences(np.arange(2)), [[0.5, -1.25], [2.75, 1.0]])
