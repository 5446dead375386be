"""Hostile inputs through the whole program: each is refused in words or solved, and no file of others is touched.

``HVI_SEED=7 HVI_CASES=300 ./hvi test --long tests/commands/test_hostile.py`` draws others, and as many; see
docs/damaged-inputs.md.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hostile import driver

pytestmark = pytest.mark.long

SEED, CASES = int(os.environ.get("HVI_SEED", "1")), int(os.environ.get("HVI_CASES", "24"))


@pytest.mark.parametrize(("kinds", "share"), [("surroundings", 1), ("requests", 12)])
def test_hostile_inputs_are_refused_or_solved(kinds: str, share: int, tmp_path: Path) -> None:
    """Requests are solved within one process: many can be drawn."""
    found = driver.attack(tmp_path, kinds, SEED, range(CASES * share))
    assert {told["number"]: (told["what"], told["faults"], told.get("text")) for told in found if told["faults"]} == {}
    assert len(found) == CASES * share
    assert {0, 2} <= {told["code"] for told in found}
