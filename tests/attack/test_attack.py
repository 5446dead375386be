"""The attack itself: random scenes, and nothing that contradicts (docs/attack.md). HVI_ATTACK_SEED gives others."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from attack import series
from judge import CONTRADICTS


@pytest.mark.long
def test_nothing_contradicts_the_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seed = int(os.environ.get("HVI_ATTACK_SEED", "20779"))
    counts = series(seed, range(100), tmp_path)
    found = capsys.readouterr().out
    with capsys.disabled():
        print(f"\nattack, seed {seed}: {counts}")
    assert not counts.words[CONTRADICTS], found
