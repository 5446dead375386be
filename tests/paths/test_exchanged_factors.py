"""Factors of the equations in which columns were exchanged: against a solution of the whole."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.paths.equations import Bordered


@pytest.mark.parametrize("seed", range(5))
def test_exchanged_columns_solve_as_new_factors(seed: int) -> None:
    """One, two or three columns at a time, some of them more than once."""
    generator = np.random.default_rng(seed)
    n = 12
    matrix = generator.standard_normal((n + 1, n + 1)) + 4.0 * np.eye(n + 1)
    factors = Bordered(np.asfortranarray(matrix))
    for _ in range(10):
        columns = generator.choice(n, generator.integers(1, 4), replace=False)
        values = generator.standard_normal((n, len(columns))) + 4.0 * np.eye(n)[:, columns]
        matrix[:n, columns] = values
        assert factors.exchange(columns, values)
        left = generator.standard_normal(n)
        assert factors.across(left) == pytest.approx(np.linalg.solve(matrix, np.append(left, 0.0)), rel=1e-9, abs=1e-9)
        along = np.linalg.solve(matrix, np.eye(n + 1)[n])
        assert factors.along == pytest.approx(along, rel=1e-9, abs=1e-9)


def test_columns_that_make_the_equations_singular_are_refused() -> None:
    matrix = np.asfortranarray(np.eye(5))
    factors = Bordered(matrix.copy(order="F"))
    assert not factors.exchange(np.array([1]), np.eye(4)[:, [2]])


def test_factors_are_made_anew_after_many_exchanges() -> None:
    factors = Bordered(np.eye(5, order="F"))
    went = [factors.exchange(np.array([1]), 2.0 * np.eye(4)[:, [1]]) for _ in range(100)]
    assert went[0]
    assert not went[-1]
