"""Whether a stiffness holds a body, and in how many directions it does the opposite."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dsytrf

from ..typing import Array

ZERO = 1e-11
"""An eigenvalue so small beside the greatest is zero."""


def rounding_of(stiffness: Array) -> float:
    """What is nothing in a stiffness, and in what is left of it where unknowns are held.

    Args:
        stiffness: symmetric, (n, n).
    """
    return len(stiffness) * float(np.finfo(float).eps * np.linalg.norm(stiffness, 1)) if len(stiffness) else 0.0


def is_singular(stiffness: Array, rounding: float) -> bool:
    """Whether some displacement meets no stiffness, or a negative one.

    Args:
        stiffness: symmetric, (n, n); of no unknowns, it is regular.
        rounding: an eigenvalue that is zero.
    """
    values = np.linalg.eigvalsh(stiffness) if len(stiffness) else np.ones(1)
    return bool(values[0] <= max(ZERO * values[-1], rounding))


def negative_directions(stiffness: Array, negligible: float, rounding: float = 0.0) -> int:
    """The number of negative eigenvalues, by the signs of the pivots of LDLᵀ (Sylvester's law of inertia).

    Args:
        stiffness: symmetric, (n, n).
        negligible: an eigenvalue that is zero, relative to the largest sum of a row; negative: zero ones count.
        rounding: an eigenvalue that is zero.
    """
    if not len(stiffness):
        return 0
    shifted = np.array(stiffness, order="F")
    size = max(abs(negligible) * float(np.linalg.norm(stiffness, 1)), rounding)
    shifted[np.diag_indices(len(shifted))] += np.copysign(size, negligible)
    factors, pivots, _ = dsytrf(shifted, lower=1, overwrite_a=1)
    pairs = pivots < 0  # a block of two pivots has one negative eigenvalue and one positive
    return int(np.count_nonzero(np.diag(factors)[~pairs] < 0.0) + np.count_nonzero(pairs) // 2)
