"""Rows of all ranks, sorted by keys: each rank gets a stretch of the sorted rows, none gets all (sample sort)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from ..typing import Array, Entities, Integers

_SAMPLES = 32
"""Rows for each rank from which it is chosen where the stretches end: they differ by some parts in so many."""


@dataclass(frozen=True, kw_only=True)
class RowOrder:
    """Where rows go so that they are sorted over all ranks, each of which gets a stretch of about equal length.

    Attributes:
        comm: the ranks.
        leaving: this rank's rows, in the order in which they leave.
        sent: how many of them go to each rank, (ranks,).
        received: how many come from each rank, (ranks,).
        arrived: those that come, in the order of their keys.
    """

    comm: MPI.Comm
    leaving: npt.NDArray[np.intp]
    sent: Entities
    received: Entities
    arrived: npt.NDArray[np.intp]

    @classmethod
    def of(cls, comm: MPI.Comm, keys: Array) -> RowOrder:
        """The order of rows by their keys, the first column counting most. Collective.

        Rows of equal keys keep the order of their ranks, and on a rank theirs.

        Args:
            comm: the ranks.
            keys: of this rank's rows, (m, k), without NaN; m may be 0.
        """
        ends = _ends(comm, keys)
        both = np.lexsort(np.vstack([ends, keys]).T[::-1])
        leaving = both[both >= len(ends)] - len(ends)
        to = np.cumsum(both < len(ends))[both >= len(ends)]
        sent = np.bincount(to, minlength=comm.size).astype(np.int32)
        received = np.empty_like(sent)
        comm.Alltoall(sent, received)
        found = cls(comm=comm, leaving=leaving, sent=sent, received=received, arrived=np.arange(received.sum()))
        arrived = np.lexsort(found.sorted(keys).T[::-1])
        return cls(comm=comm, leaving=leaving, sent=sent, received=received, arrived=arrived)

    def sorted(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """This rank's stretch of the sorted rows, of which each rank gives what it has. Collective.

        Args:
            values: of this rank's rows, (m, ...), in the order of the keys that were given.
        """
        leaving = np.ascontiguousarray(values[self.leaving])
        width = int(np.prod(values.shape[1:]))
        arrived = np.empty((int(self.received.sum()), *values.shape[1:]), values.dtype)
        self.comm.Alltoallv([leaving, self.sent * width], [arrived, self.received * width])
        return np.asarray(arrived[self.arrived])


def distinct(comm: MPI.Comm, rows: Integers) -> Integers:
    """This rank's stretch of the distinct rows of all ranks, ascending, the first column counting most. Collective.

    Args:
        comm: the ranks.
        rows: of this rank, (m, k), below 2^53.
    """
    return np.unique(RowOrder.of(comm, rows.astype(np.float64)).sorted(rows), axis=0)  # equal rows are on one rank


def _ends(comm: MPI.Comm, keys: Array) -> Array:
    """The keys at which each stretch but the first begins, (ranks - 1, k); none where there are no rows. Collective."""
    step = max(1, comm.allreduce(len(keys)) // (comm.size * _SAMPLES))
    own = keys[np.lexsort(keys.T[::-1])][step // 2 :: step]
    samples = np.concatenate(comm.allgather(own))
    samples = samples[np.lexsort(samples.T[::-1])]
    if not len(samples):
        return samples
    return np.asarray(samples[np.arange(1, comm.size) * len(samples) // comm.size])
