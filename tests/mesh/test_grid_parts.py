"""Each vertex of a grid has one owner, and all ranks call it by the owner's number: else a mesh falls apart."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from hvi_fenicsx.mesh import blocks


def found_by_ranks(parts, counts):
    """What each rank finds when the ranks own so many vertices."""
    comms = [SimpleNamespace(rank=rank, size=len(parts), allgather=lambda _: counts) for rank in range(len(parts))]
    return [blocks.vertices(comm, parts) for comm in comms]


@pytest.mark.parametrize("reflected", [(), (0,)])
@pytest.mark.parametrize(("cells", "ranks"), [([4, 4], 3), ([7, 5], 7), ([1, 1], 3), ([3, 5, 2], 5), ([4, 4, 4], 8)])
def test_every_vertex_is_owned_once_and_known_by_one_number(cells, ranks, reflected):
    parts = [blocks.part_of_rank(cells, ranks, rank, reflected) for rank in range(ranks)]
    first, numbers = found_by_ranks(parts, [0] * ranks), {}
    counts = [found.owned for found in first]
    for rank, found in enumerate(found_by_ranks(parts, counts)):
        assert np.array_equal(np.sort(found.local), np.arange(len(found.places)))
        assert np.all(found.owners < rank)
        own = sum(counts[:rank]) + np.arange(found.owned)
        for place, number in zip(found.places.tolist(), [*own, *found.ghosts], strict=True):
            assert numbers.setdefault(tuple(place), number) == number
    assert len(numbers) == np.prod([n + 1 for n in cells])
    assert sorted(numbers.values()) == list(range(len(numbers)))
