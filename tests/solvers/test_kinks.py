"""Vertices that rest on upward jumps of a law: these must carry their force with its falling parts as they are."""

from __future__ import annotations

import pytest
from scenes import Table, model, solved

FALLS_BEFORE_JUMP: Table = {
    "law": "graph",
    "points": [[0, 0], [1e-8, 4e5], [4.5e-8, -5e4], [4.5e-8, 2.3e5], [1.3e-7, 1.5e5]],
}


@pytest.mark.parametrize(("cells", "pull"), [(1, 2e5), (2, 3e5)])
def test_a_jump_is_judged_with_the_fall_before_it(cells: int, pull: float) -> None:
    """In the first step the law only rises, and a vertex stops at its jump; with the fall, the jump cannot hold it."""
    found = solved(model(cells, pull, 1e6, FALLS_BEFORE_JUMP))
    assert found.exit_code == 0
