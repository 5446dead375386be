"""Where it is said that S plus slopes from intervals is never singular, no choice of slopes makes it so."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hvi_fenicsx.stationary_points.regular_slopes import is_regular
from hvi_fenicsx.typing import Array

FAR = 1e9


def case(seed: int, size: int = 4) -> tuple[Array, Array, Array]:
    """A semidefinite matrix, and ranges of slopes of any sign; some have no upper end."""
    random = np.random.default_rng(seed)
    factor = random.normal(size=(size, size - 1))
    least = random.normal(size=size)
    most = least + 10.0 ** random.uniform(-3.0, 0.7, size)
    return factor @ factor.T, least, np.where(random.uniform(size=size) < 0.3, np.inf, most)


def signs(stiffness: Array, least: Array, most: Array) -> set[float]:
    """Signs of the determinant at all corners of the ranges: it is linear in each slope, so others lie between."""
    ends = zip(least, np.where(np.isfinite(most), most, FAR), strict=True)
    return {float(np.sign(np.linalg.det(stiffness + np.diag(slopes)))) for slopes in itertools.product(*ends)}


def test_ranges_that_are_called_regular_hold_no_singular_matrix() -> None:
    cases = [case(seed) for seed in range(600)]
    regular = [is_regular(*one) for one in cases]
    truly = [len(signs(*one)) == 1 for one in cases]
    assert not any(said and not true for said, true in zip(regular, truly, strict=True))
    assert sum(regular) > 0.5 * sum(truly) > 50
    indefinite = [
        said for said, one in zip(regular, cases, strict=True) if np.linalg.eigvalsh(one[0] + np.diag(one[1]))[0] < 0.0
    ]
    assert sum(indefinite) > 20  # saddles, too


@pytest.mark.parametrize("seed", range(50))
def test_where_the_least_slopes_leave_it_positive_definite_all_are_regular(seed: int) -> None:
    stiffness, least, most = case(seed)
    least += 0.05 - min(np.linalg.eigvalsh(stiffness + np.diag(least))[0], 0.0)
    assert is_regular(stiffness, least, np.maximum(most, least))


def test_a_range_with_a_singular_matrix_at_its_end_is_not_regular() -> None:
    assert not is_regular(np.eye(1), np.array([-1.0]), np.array([0.5]))
    assert is_regular(np.eye(1), np.array([-0.999]), np.array([np.inf]))
    assert not is_regular(np.eye(1), np.array([-np.inf]), np.array([0.5]))
    assert is_regular(np.empty((0, 0)), np.empty(0), np.empty(0))
