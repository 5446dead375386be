"""The attack itself: random scenes, with a new seed each day, and nothing that contradicts (docs/attack.md)."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from attack import series
from judge import CONTRADICTS


@pytest.mark.long
def test_nothing_contradicts_the_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seed = int(os.environ.get("HVI_ATTACK_SEED", time.time() // 86400))
    counts = series(seed, range(100), tmp_path)
    found = capsys.readouterr().out
    with capsys.disabled():
        print(f"\nattack, seed {seed}: {counts}")
    assert not counts.words[CONTRADICTS], found
