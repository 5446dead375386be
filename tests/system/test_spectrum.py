"""The number of negative directions is that of the negative eigenvalues, also where some are zero."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.reduced.condensed_stiffness import negative_directions


@pytest.mark.parametrize("size", [0, 1, 2, 7, 60])
def test_as_many_as_negative_eigenvalues(size: int) -> None:
    generator = np.random.default_rng(size)
    for negative in range(min(size, 6) + 1):
        values = np.r_[-generator.uniform(0.1, 1.0, negative), generator.uniform(0.1, 1.0, size - negative)]
        values[negative : negative + 1] = 0.0
        basis = np.linalg.qr(generator.standard_normal((size, size)))[0]
        assert negative_directions(basis @ np.diag(values) @ basis.T, 1e-12) == negative
