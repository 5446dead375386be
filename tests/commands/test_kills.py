"""Random kills: whatever ends a run and whenever, its folder holds one whole result, and the next run works."""

from __future__ import annotations

import os
import random
import time
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from kills import WAYS, end, started
from mpi4py import MPI
from runs import command, contact, hvi, process, summary, write_scene
from scenes import model, quadratic_linear

from hvi_fenicsx.results import ResultFolder
from hvi_fenicsx.runtime import manifest

pytestmark = pytest.mark.long

FIRST, ROUNDS, KILLS = int(os.environ.get("HVI_SEED", "0")), int(os.environ.get("HVI_ROUNDS", "6")), 5
"""Thirty kills in all, HVI_SEED draws others; those while forms compile are in tests/runtime/test_forms.py."""
STARTUP = 0.2
"""The part of a whole run in which Python itself starts, and words its end itself."""
CELLS = {"few": 4, "more": 8}
"""Two scenes, told apart by their title and the length of their tables."""


@pytest.mark.parametrize("seed", range(FIRST, FIRST + ROUNDS))
def test_a_kill_leaves_a_whole_result_and_the_next_run_works(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    scenes = {title: scene(tmp_path, title) for title in CELLS}
    out = tmp_path / "r"
    span = min(seconds(scenes[title], out) for title in CELLS)
    (out / "mine.txt").write_text("precious")
    for _ in range(KILLS):
        killed(chance, span, scenes[chance.choice(list(scenes))], out)
        assert_whole(out)
        assert (out / "mine.txt").read_text() == "precious"
    assert hvi("run", scenes["more"], "--out", out, "--force", "--no-pictures").returncode == 0
    assert summary(out)["scene"] == "more"
    assert sorted(f.name for f in tmp_path.iterdir()) == ["few.toml", "more.toml", "r"]


def scene(folder: Path, title: str) -> Path:
    """A scene file; its title is its name."""
    return write_scene(
        folder / f"{title}.toml", {**model(CELLS[title], friction=quadratic_linear(1e3)), "title": title}
    )


def seconds(file: Path, out: Path) -> float:
    """How long a whole run takes; the first one also makes what the machine keeps."""
    began = time.monotonic()
    assert process("run", file, "--out", out, "--force").returncode == 0
    return time.monotonic() - began


def killed(chance: random.Random, span: float, file: Path, out: Path) -> None:
    """Start a run over the result that is there and end it at a random moment, in a random way."""
    way, ranks = chance.choice(WAYS), chance.choice([(), ("--np", "2")])
    run = started(command("run", file, "--out", out, "--force", *ranks))
    time.sleep(chance.uniform(STARTUP * span, span * (1.3 if ranks else 1.0)))
    end(run, way, chance)


def assert_whole(out: Path) -> None:
    """Every file is there and speaks of one scene, after a kill between the moves once the rest is moved."""
    if not (out / "summary.json").exists():
        ResultFolder(MPI.COMM_SELF, out, force=True).discard()
    found = manifest.read(out)
    assert found is not None
    assert found.damaged(out) is None
    record = summary(out)
    title = record["scene"]
    assert tomllib.loads((out / "scene.toml").read_text(encoding="utf-8"))["title"] == title
    assert len(contact(out)) == CELLS[title] + 1
    assert record["converged"] == (record["exit_code"] == 0)
    for index in out.glob("*.pvd"):
        for piece in ET.parse(index).iter("DataSet"):
            ET.parse(out / piece.attrib["file"])
    assert len(list(out.glob("*.pvd"))) == 2
    assert all(picture.read_bytes().endswith(b"IEND\xaeB`\x82") for picture in out.glob("*.png"))
