"""Whether a stiffness holds a body, and in how many directions it does the opposite."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dsytrf

from ..typing import Array

ZERO = 1e-11
"""An eigenvalue so small beside the greatest is zero."""


def is_singular(stiffness: Array) -> bool:
    """Whether some displacement meets no stiffness, or a negative one.

    Args:
        stiffness: symmetric, (n, n); of no unknowns, it is regular.
    """
    values = np.linalg.eigvalsh(stiffness) if len(stiffness) else np.ones(1)
    return bool(values[0] <= ZERO * values[-1])


def negative_directions(stiffness: Array, negligible: float) -> int:
    """The number of negative eigenvalues, by the signs of the pivots of LDLᵀ (Sylvester's law of inertia).

    Args:
        stiffness: symmetric, (n, n).
        negligible: an eigenvalue that is zero, relative to the largest sum of a row.
    """
    if not len(stiffness):
        return 0
    shifted = np.array(stiffness, order="F")
    shifted[np.diag_indices(len(shifted))] += negligible * float(np.linalg.norm(stiffness, 1))
    factors, pivots, _ = dsytrf(shifted, lower=1, overwrite_a=1)
    pairs = pivots < 0  # a block of two pivots has one negative eigenvalue and one positive
    return int(np.count_nonzero(np.diag(factors)[~pairs] < 0.0) + np.count_nonzero(pairs) // 2)
