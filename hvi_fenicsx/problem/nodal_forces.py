"""Forces at some vertices of this rank, which alone are kept: of loads, contact, laws and supports."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..typing import Array, Entities


@dataclass(frozen=True)
class NodalForces:
    """Forces at some of the vertices that this rank owns (m of them).

    Attributes:
        blocks: local indices of the vertices, ascending, (m,).
        values: the forces, (m, d).
    """

    blocks: Entities
    values: Array

    @classmethod
    def of(cls, values: Array) -> NodalForces:
        """Those that are not zero, of forces at all vertices that this rank owns, (n, d)."""
        blocks = np.flatnonzero(values.any(axis=1)).astype(np.int32)
        return cls(blocks, values[blocks])

    def at(self, blocks: Entities) -> Array:
        """The forces at k vertices, zero where there is none, (k, d).

        Args:
            blocks: their local indices, each once, (k,).
        """
        found = np.zeros((len(blocks), self.values.shape[1]))
        _, there, here = np.intersect1d(blocks, self.blocks, assume_unique=True, return_indices=True)
        found[there] = self.values[here]
        return found

    def __add__(self, other: NodalForces) -> NodalForces:
        blocks = np.union1d(self.blocks, other.blocks).astype(np.int32)
        return NodalForces(blocks, self.at(blocks) + other.at(blocks))
