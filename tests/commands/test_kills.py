"""Random kills: whatever ends a run and whenever, its folder holds one whole result, and the next run works."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
import tomllib
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from runs import command, contact, hvi, summary, write_scene
from scenes import model, quadratic_linear

from hvi_fenicsx.results.output_folder import OutputFolder
from hvi_fenicsx.runtime import manifest

pytestmark = pytest.mark.long

ROUNDS, KILLS = 14, 5
"""Seventy kills in all; those while forms compile are in test_kills_compiling.py."""
STARTUP = 0.2
"""Seconds, or the part of a whole run where that is more, in which Python itself starts, and words its end itself."""
SOFT = ("SIGINT", "SIGTERM", "SIGHUP")
"""Requests to stop."""
CELLS = {"few": 4, "more": 8}
"""Two scenes, told apart by their title and the length of their tables."""


@pytest.mark.parametrize("seed", range(ROUNDS))
def test_a_kill_leaves_a_whole_result_and_the_next_run_works(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    scenes = {title: scene(tmp_path, title) for title in CELLS}
    out = tmp_path / "r"
    began = time.monotonic()
    assert hvi("run", scenes["few"], "--out", out).returncode == 0
    span = time.monotonic() - began
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


def killed(chance: random.Random, span: float, file: Path, out: Path) -> None:
    """Start a run over the result that is there and end it at a random moment, in a random way."""
    way, ranks = chance.choice([*SOFT, "SIGKILL", "one rank"]), chance.choice([(), ("--np", "2")])
    words = command("run", file, "--out", out, "--force", *ranks)
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    time.sleep(chance.uniform(max(STARTUP, STARTUP * span), span))
    kin = family(process.pid)
    if way == "SIGKILL":
        os.killpg(process.pid, signal.SIGKILL)
    elif way == "one rank":
        os.kill(chance.choice(kin), signal.SIGKILL)
    else:
        process.send_signal(getattr(signal, way))
    _, errors = process.communicate(timeout=120)
    wait_for_end(kin)
    if way in SOFT:
        # negative: before the program's own first line
        assert process.returncode in (0, 130, -getattr(signal, way)), (way, ranks, errors)
        assert "Traceback" not in errors


def family(pid: int) -> list[int]:
    """The processes that a run has started, itself first."""
    found = [pid]
    for parent in found:
        found += children(parent)
    return found


def wait_for_end(processes: list[int]) -> None:
    """Ranks whose launcher was killed end a little later, and hold the folder until then."""
    end = time.monotonic() + 60
    while any(Path(f"/proc/{process}").exists() for process in processes):
        assert time.monotonic() < end, "processes stay"
        time.sleep(0.1)


def children(pid: int) -> list[int]:
    """Its child processes, while it lives."""
    try:
        return [int(c) for t in Path(f"/proc/{pid}/task").iterdir() for c in (t / "children").read_text().split()]
    except OSError:
        return []


def assert_whole(out: Path) -> None:
    """Every file is there and speaks of one scene, after a kill between the moves once the rest is moved."""
    if not (out / "summary.json").exists():
        OutputFolder(out, "result").close()
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
