"""Forces on few of a space's blocks: what facets of Γc give, without arrays of the whole mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from dolfinx import fem, la

from ...typing import Array, Entities


@dataclass(frozen=True)
class BlockForces:
    """Forces at some blocks of a space, zero at all others.

    Attributes:
        blocks: local numbers, ascending, each once, (k,).
        values: the forces, (k, d).
    """

    blocks: Entities
    values: Array

    def __sub__(self, other: BlockForces) -> BlockForces:
        return summed([(self.blocks, self.values), (other.blocks, -other.values)], self.values.shape[1])

    def everywhere(self, count: int) -> Array:
        """The forces at all of the first blocks, (count, d)."""
        found = np.zeros((count, self.values.shape[1]))
        found[self.blocks] = self.values
        return found


def summed(parts: Sequence[tuple[npt.NDArray[np.integer], Array]], dimension: int) -> BlockForces:
    """The sum of forces.

    Args:
        parts: blocks in any order, also several times, (k,), with the forces there, (k, d).
        dimension: d.
    """
    every = np.concatenate([np.empty(0, np.int32), *(blocks for blocks, _ in parts)])
    blocks, numbers = np.unique(every, return_inverse=True)
    values = np.zeros((len(blocks), dimension))
    np.add.at(values, numbers, np.concatenate([np.empty((0, dimension)), *(forces for _, forces in parts)]))
    return BlockForces(blocks.astype(np.int32), values)


def gathered(space: fem.FunctionSpace, forces: BlockForces) -> BlockForces:
    """What all ranks give, at the owned blocks. Collective.

    Args:
        space: of the blocks.
        forces: of this rank, at owned blocks and ghosts.
    """
    if space.mesh.comm.size == 1:
        return forces
    field, owned = fem.Function(space), space.dofmap.index_map.size_local
    everywhere = field.x.array.reshape(-1, forces.values.shape[1])
    everywhere[forces.blocks] = forces.values
    field.x.scatter_reverse(la.InsertMode.add)
    blocks = np.flatnonzero(np.any(everywhere[:owned], axis=1)).astype(np.int32)
    return BlockForces(blocks, everywhere[blocks])
