"""The vertices of a rank's part of a grid, and which rank owns each: known without a message but their counts.

A part is a box of cells, and its vertices are those of the closed box. Of several ranks whose boxes meet at a vertex
the first one owns it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from ..typing import Entities, Integers, Mask

Box = tuple[Integers, Integers]
"""The first cell of a part, and the one after the last, (d,) both."""


@dataclass(frozen=True, kw_only=True)
class PartVertices:
    """The vertices of one rank's part.

    Attributes:
        places: their integer coordinates in the grid, those that the rank owns first, (n, d).
        local: the local number of each vertex of the part's own grid, x running fastest, (n,).
        owned: how many the rank owns.
        ghosts: the global numbers of the others, (g,).
        owners: the ranks that own these, (g,).
    """

    places: Integers
    local: Entities
    owned: int
    ghosts: Integers
    owners: Entities


def vertices(comm: MPI.Comm, parts: Sequence[Box]) -> PartVertices:
    """The vertices of this rank's part. Collective.

    Args:
        comm: the ranks.
        parts: of all ranks; those without cells have no vertices.
    """
    owner = _owners(parts, comm.rank)
    own = owner == comm.rank
    order = np.concatenate([np.flatnonzero(own), np.flatnonzero(~own)])
    local = np.empty(len(order), dtype=np.int32)
    local[order] = np.arange(len(order), dtype=np.int32)
    owned = int(np.count_nonzero(own))
    first = np.concatenate([[0], np.cumsum(comm.allgather(owned))])
    places, others = _vertex_places(parts[comm.rank])[order], owner[order[owned:]].astype(np.int32)
    ghosts = np.empty(len(others), dtype=np.int64)
    for rank in np.unique(others):
        at = others == rank
        ghosts[at] = first[rank] + _numbers_of_owner(parts, int(rank), places[owned:][at])
    return PartVertices(places=places, local=local, owned=owned, ghosts=ghosts, owners=others)


def _counts(part: Box) -> Integers:
    """Vertices each way; none where the part has no cells."""
    extent = part[1] - part[0]
    return np.where(np.all(extent > 0), extent + 1, 0)


def _vertex_places(part: Box) -> Integers:
    """The integer coordinates of a part's vertices, x running fastest, (n, d)."""
    counts = _counts(part)
    ways = np.unravel_index(np.arange(int(np.prod(counts))), counts, order="F")
    return np.stack(ways, axis=1) + part[0]


def _owners(parts: Sequence[Box], rank: int) -> Integers:
    """The rank that owns each vertex of a part, x running fastest, (n,)."""
    lower, upper = parts[rank]
    owner = np.full(_counts(parts[rank]), rank, dtype=np.int64)
    for other, (begin, end) in enumerate(parts[:rank]):
        low, high = np.maximum(begin, lower), np.minimum(end, upper)
        if owner.size and np.all(end > begin) and np.all(high >= low):
            shared = tuple(slice(a, b + 1) for a, b in zip(low - lower, high - lower, strict=True))
            owner[shared] = np.minimum(owner[shared], other)
    return owner.ravel(order="F")


def _numbers_of_owner(parts: Sequence[Box], rank: int, places: Integers) -> Integers:
    """The numbers that a rank gives to vertices which it owns, counted from 0, (g,)."""
    own: Mask = _owners(parts, rank) == rank
    counts = _counts(parts[rank])
    at = np.ravel_multi_index(tuple((places - parts[rank][0]).T), tuple(counts), order="F")
    return np.asarray((np.cumsum(own) - 1)[at])
