"""Elastic parts e = G(f - τ) of displacements for intervals of the forces τ, and by how much two of them differ.

The difference of two parts has an interval of its own, often far shorter than those of the two: what both have in
common drops out. So where one vertex of a soft floor is known, the next is nearly known, however far the floor
stretches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from ..typing import Array, Integers


@dataclass(frozen=True, kw_only=True)
class ElasticParts:
    """The intervals of the elastic parts.

    Attributes:
        middle: their middles, (n,).
        rows: half of what each force adds to the length of each interval, with its sign, (n, n).
        error: by how much G is off, rounding included, (n,).
    """

    middle: Array
    rows: Array
    error: Array

    @property
    def ends(self) -> tuple[Array, Array]:
        """The ends of the intervals, (n,) each."""
        reach = np.abs(self.rows).sum(axis=1) + self.error
        return self.middle - reach, self.middle + reach

    def differences(self, chosen: Integers) -> Array:
        """The most by which one part is above another, (k, k): that of the row above that of the column.

        Args:
            chosen: the parts, (k,).
        """
        middle, rows, error = self.middle[chosen], self.rows[chosen], self.error[chosen]
        reach = cdist(rows, rows, "cityblock") + error[:, None] + error
        return np.asarray(middle[:, None] - middle + reach)
