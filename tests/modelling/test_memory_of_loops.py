"""Calls from Python leave nothing: neither PETSc objects, which Python frees on one rank only, nor memory."""

from __future__ import annotations

import pytest
from runs import on_ranks

MOST_MEMORY = 8.0
"""MB by which 20 further calls may fill what was set free; paths that were not freed took 18 or more."""


@pytest.mark.long
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_loop_of_calls_does_not_grow(ranks: int) -> None:
    found = on_ranks(ranks, "tests/modelling/memory_ranks.py")
    for name, counts in found.items():
        few, more = counts["objects"]
        assert more == few, name
        before, after = counts["memory"]
        assert after - before < MOST_MEMORY, name
