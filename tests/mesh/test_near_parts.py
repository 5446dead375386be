"""The parts of several bodies that one rank has: those that meet are on one rank."""

from __future__ import annotations

from pathlib import Path

import pytest
from runs import on_ranks


def test_blocks_on_each_other_meet_within_ranks_on_all_levels() -> None:
    """Four ranks have a quarter of each block: those on top of the lower one lie under the upper one's upper ones."""
    found = on_ranks(4, str(Path(__file__).parent / "near_parts_ranks.py"))
    assert found == pytest.approx([0.0, 0.5, 0.5])
