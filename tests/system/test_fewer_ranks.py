"""Coarse levels of multigrid on fewer ranks have the same products, and follow what they are made of."""

from __future__ import annotations

import numpy as np
import pytest
from placed_ranks import COARSE, FINE, dense
from runs import on_ranks

from hvi_fenicsx.system.multigrid import joined_ranks


@pytest.mark.parametrize(
    ("unknowns", "ranks", "joined"),
    [(10_000, 4, 1), (2_000, 4, 1), (1_999, 4, 2), (1_000, 4, 2), (999, 4, 4), (1, 4, 4), (1, 1, 1), (1_500, 16, 6)],
)
def test_ranks_are_joined_until_each_has_enough(unknowns: int, ranks: int, joined: int) -> None:
    assert joined_ranks(unknowns, ranks, least=500) == joined


def test_a_placed_matrix_is_the_matrix_on_fewer_ranks() -> None:
    found = on_ranks(3, "tests/system/placed_ranks.py")
    assert found["rows"] == [[10, 0, 4], [COARSE, 0, 0]]
    fine = dense(FINE, FINE) @ np.arange(FINE)
    products = [fine, fine, 2 * fine, dense(COARSE, COARSE) @ np.arange(COARSE)]
    for one, other in zip(found["products"], products, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(found["prolonged"], dense(FINE, COARSE) @ np.arange(COARSE), rtol=1e-13, atol=1e-13)
    assert found["same"]
