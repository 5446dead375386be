"""The array types of the package."""

from __future__ import annotations

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
