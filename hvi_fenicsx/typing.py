"""The array types of the package, and how large an array is."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.floating]
"""Real numbers."""
Entities = npt.NDArray[np.int32]
"""Local numbers of cells, facets, vertices or unknowns, as dolfinx keeps them."""
Integers = npt.NDArray[np.int64]
"""Whole numbers."""
Mask = npt.NDArray[np.bool_]
"""Yes or no."""


def together(parts: Iterable[Entities]) -> Entities:
    """Numbers one after the other; none where there are no parts.

    Args:
        parts: (n,) each.
    """
    return np.concatenate([np.empty(0, np.int32), *parts])


def magnitude(values: npt.ArrayLike) -> float:
    """The largest absolute value, 0 of none.

    Args:
        values: numbers.
    """
    return float(np.abs(values).max(initial=0.0))
