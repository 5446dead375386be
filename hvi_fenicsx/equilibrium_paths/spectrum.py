"""Whether a stiffness holds a body, by its least eigenvalue."""

from __future__ import annotations

import numpy as np

from ..typing import Array

_ZERO = 1e-11
"""An eigenvalue so small beside the greatest is zero."""


def is_singular(stiffness: Array) -> bool:
    """Whether some displacement meets no stiffness, or a negative one.

    Args:
        stiffness: symmetric, (n, n); of no unknowns, it is regular.
    """
    values = np.linalg.eigvalsh(stiffness) if len(stiffness) else np.ones(1)
    return bool(values[0] <= _ZERO * values[-1])
