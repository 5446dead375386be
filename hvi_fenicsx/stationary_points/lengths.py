"""Vectors of unknowns on whose lengths laws act: a slip in space, or an opening and a slip together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..typing import Array, Integers, Mask


@dataclass(frozen=True, kw_only=True)
class Lengths:
    """The vectors factors * x[unknowns], m of them, of up to three components; no unknown is in two of them.

    The length δ of a vector leaves out a first component that is an opening and negative.

    Attributes:
        unknowns: numbers, (m, 3); those behind the last component do not matter.
        factors: 0 behind the last component, (m, 3).
        opens: whether the first component is an opening, (m,).
    """

    unknowns: Integers
    factors: Array
    opens: Mask

    @classmethod
    def none(cls) -> Lengths:
        """No vector."""
        return cls(
            unknowns=np.empty((0, 3), dtype=np.int64), factors=np.empty((0, 3)), opens=np.empty(0, dtype=np.bool_)
        )

    def __len__(self) -> int:
        return len(self.opens)

    @cached_property
    def there(self) -> Mask:
        """Which components there are, (m, 3)."""
        return np.asarray(self.factors != 0.0)

    @cached_property
    def members(self) -> Integers:
        """All unknowns of the vectors, one after the other."""
        return self.unknowns[self.there]

    def vectors(self, x: Array) -> Array:
        """The vectors, (m, 3).

        Args:
            x: the unknowns, (n,).
        """
        return np.asarray(self.factors * x[self.unknowns])

    def felt(self, vectors: Array) -> Array:
        """The vectors without openings that are negative, (m, 3).

        Args:
            vectors: (m, 3).
        """
        result = vectors.copy()
        result[self.opens, 0] = np.maximum(result[self.opens, 0], 0.0)
        return result

    def of(self, x: Array) -> Array:
        """The lengths δ, (m,).

        Args:
            x: the unknowns, (n,).
        """
        return np.asarray(np.linalg.norm(self.felt(self.vectors(x)), axis=1))

    def along(self, forces: Array) -> Array:
        """Forces on unknowns as forces along the vectors' components, (m, 3).

        Args:
            forces: (n,).
        """
        return np.divide(forces[self.unknowns], self.factors, out=np.zeros_like(self.factors), where=self.there)

    def diagonal(self, d: Array, size: int) -> Array:
        """The diagonal, (n,), of the quadratic form Σ dᵢ |vector i|².

        Args:
            d: (m,).
            size: number of unknowns n.
        """
        result = np.zeros(size)
        result[self.members] = (d[:, None] * self.factors**2)[self.there]
        return result

    def within(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest lengths in a box, (m,) each.

        Args:
            low: of the unknowns, (n,).
            high: of the unknowns, (n,).
        """
        ends = np.stack([self.vectors(low), self.vectors(high)])
        below, above = self.felt(ends.min(axis=0)), self.felt(ends.max(axis=0))
        least = np.where((below <= 0.0) & (above >= 0.0), 0.0, np.minimum(np.abs(below), np.abs(above)))
        most = np.maximum(np.abs(below), np.abs(above))
        return np.linalg.norm(least, axis=1), np.linalg.norm(most, axis=1)
