"""A long action on rank 0 that asks all ranks whether to stop."""

from __future__ import annotations

from pathlib import Path

import pytest
from runs import on_ranks


@pytest.mark.parametrize("ranks", [1, 3])
def test_any_rank_stops_what_rank_0_does_alone(ranks: int) -> None:
    told = on_ranks(ranks, str(Path(__file__).parent / "asking_ranks.py"))
    assert told == [[[3, -1], 3]] * ranks
