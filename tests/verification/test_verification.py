"""The cases of `verification/`: all are well formed, and the quick ones agree with what was published."""

from __future__ import annotations

import subprocess
import sys

import pytest
from runs import ROOT

from hvi_fenicsx import read_scene

sys.path.insert(0, str(ROOT / "verification"))
import itertools

import quantities
import verify

QUICK = ("glued_bar_short", "hertz_plane", "inclined_crack")


@pytest.mark.parametrize("case", verify.cases(), ids=lambda case: case["name"])
def test_a_case_reads_a_scene_and_known_quantities(case: dict[str, object]) -> None:
    command = case["command"]
    assert read_scene(ROOT / command[1], [w for o, w in itertools.pairwise(command) if o == "--set"])
    assert all(quantities.made(table) for table in case["expected"])
    assert case["source"]


@pytest.mark.long
@pytest.mark.parametrize("name", QUICK)
def test_a_quick_case_agrees(name: str) -> None:
    words = [sys.executable, "verification/verify.py", name]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "agrees" in done.stdout
