"""Random kills of `path`, `equilibria` and two bodies: nothing torn or lost, and `--resume` ends as a whole run does.

Between the kills the folder holds a whole result, or what was kept of an unfinished one; files of others stay.
"""

from __future__ import annotations

import os
import random
import time
from pathlib import Path
from typing import Any

import pytest
from kills import WAYS, end, started
from mpi4py import MPI
from runs import command, hvi, summary, write_scene
from scenes import model, quadratic_linear, two_blocks

from hvi_fenicsx.results import ResultFolder
from hvi_fenicsx.runtime import manifest

pytestmark = pytest.mark.long

FIRST, ROUNDS = int(os.environ.get("HVI_SEED", "0")), int(os.environ.get("HVI_ROUNDS", "2"))
KILLS = 5
STRONG = model(5, 6e6, friction=quadratic_linear(3e6)) | {"path": {"to": [1.0, 0.3, 1.05]}}
PAIR = two_blocks("rectangle", [0.6], [[6, 4], [5, 4]], "plane_strain") | {"title": "pair"}
CASES = {"path": STRONG, "equilibria": STRONG, "run": PAIR}


@pytest.mark.parametrize("seed", range(FIRST, FIRST + ROUNDS))
@pytest.mark.parametrize("name", list(CASES))
def test_kills_tear_and_lose_nothing(name: str, seed: int, tmp_path: Path) -> None:
    chance = random.Random(f"{name}{seed}")
    scene = write_scene(tmp_path / "scene.toml", CASES[name])
    words, out = [name, scene, "--no-pictures", "--out"], tmp_path / "r"
    began = time.monotonic()
    assert hvi(*words, tmp_path / "whole").returncode == 0
    span = time.monotonic() - began + 1.0  # Python starts, too
    out.mkdir()
    for _ in range(KILLS):
        killed([*words, out, "--resume"], chance, span)
        assert_sound(out)
        if manifest.read(out) is not None:  # in a folder of others nothing would be written
            (out / "mine.txt").write_text("precious")
    done = hvi(*words, out, "--resume")
    assert done.returncode == 0, done.stderr
    assert_sound(out)
    assert numbers(out) == pytest.approx(numbers(tmp_path / "whole"), rel=1e-6)
    assert all(file.read_text() == "precious" for file in out.glob("mine*"))
    assert len(list(out.glob("mine*"))) <= 1
    assert sorted(f.name for f in tmp_path.iterdir()) == ["r", "scene.toml", "whole"]


def killed(words: list[object], chance: random.Random, span: float) -> None:
    """Start a run and end it at a random moment, in a random way."""
    way, ranks = chance.choice(WAYS), chance.choice([[], ["--np", "2"]])
    process = started(command(*words, *ranks))
    time.sleep(chance.uniform(0.3, span * (2.0 if ranks else 1.0)))
    end(process, way, chance)


def assert_sound(out: Path) -> None:
    """Every file that the manifest lists is as it was written; the summary is there, or the run is unfinished."""
    ResultFolder(MPI.COMM_SELF, out, force=True).discard()  # goes on where a kill between the moves left the folder
    found = manifest.read(out)
    if found is None:
        assert list(out.iterdir()) == []
        return
    assert found.damaged(out) is None
    for folder in out.glob("equilibrium-*"):
        inner = manifest.read(folder)
        assert inner is not None
        assert inner.damaged(folder) is None
    if (out / "summary.json").exists() and "equilibria" in (record := summary(out)):
        assert len(list(out.glob("equilibrium-*"))) == record["equilibria"]["count"]


def numbers(out: Path) -> list[Any]:
    """What a result says in numbers."""
    record = summary(out)
    if "equilibria" in record:
        known = record["equilibria"]
        return [known["count"], known["lowest_energy"], float(known["proven"])]
    if record.get("path"):
        return [record["path"][name] for name in ("rows", "work", "dissipated", "peak_factor")]
    return [record["energy"], record["contact"]["active"]]
