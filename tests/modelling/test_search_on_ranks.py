"""Ranks that search for equilibria say what they do once, and end together where they do not agree."""

from __future__ import annotations

from pathlib import Path

import pytest
from runs import on_ranks


@pytest.mark.long
def test_a_search_is_told_on_rank_0_and_different_points_are_refused_on_all() -> None:
    (count, certified, said), other = on_ranks(2, str(Path(__file__).parent / "search_ranks.py"))
    assert count == certified == 1
    assert other == [count, 0, said]
    assert said == "the ranks found different equilibria; run on one"
