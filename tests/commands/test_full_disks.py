"""A file that finds no room, whichever it is: one message that names it, exit code 2, and nothing half-written."""

from __future__ import annotations

import csv
import subprocess
from pathlib import Path

import numpy as np
import pytest
from full_disk import room_for
from runs import ROOT, hvi, on_ranks, write_scene
from scenes import model, quadratic_linear

BAR = ROOT / "demos" / "glued_bar.toml"
SHORT = ("--set", "domain.size=[0.05, 0.001]", "--set", "domain.cells=[10, 1]")


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "square.toml", model(2, friction=quadratic_linear(1e3)))


def refused(done: subprocess.CompletedProcess[str], out: Path, name: str) -> None:
    """One line that names the file as the user knows it."""
    words = f"hvi: --out {out}: {name} could not be written: File too large; make room on the disk"
    assert (done.returncode, done.stderr.count("\n"), done.stderr[: len(words)]) == (2, 1, words)


@pytest.mark.parametrize("name", ["report.html", pytest.param("path.png", marks=pytest.mark.long), "path.journal"])
def test_a_path_keeps_its_rows_until_there_is_room(name: str, tmp_path: Path) -> None:
    """The page holds the picture, and both are larger than all other files."""
    whole, out = tmp_path / "whole", tmp_path / "r"
    hvi("path", BAR, "--out", whole, *SHORT)
    picture = (whole / "path.png").stat().st_size
    with room_for({"report.html": picture + 100, "path.png": picture - 100, "path.journal": 4_000}[name]):
        refused(hvi("path", BAR, "--out", out, *SHORT), out, name)
    assert sorted(f.name for f in tmp_path.iterdir()) == ["r", "whole"]
    assert sorted(f.name for f in out.iterdir()) == ["manifest.json", "path.journal"]
    done = hvi("path", BAR, "--out", out, *SHORT, "--resume", "--no-pictures")
    assert done.returncode == 0, done.stderr
    assert "rows are there already" in done.stdout
    found, expected = (factors(folder) for folder in (out, whole))
    np.testing.assert_allclose(found, expected, rtol=1e-12)


def factors(folder: Path) -> list[float]:
    with (folder / "path.csv").open(newline="", encoding="utf-8") as stream:
        return [float(row["factor"]) for row in csv.DictReader(stream)]


@pytest.mark.parametrize(("room", "name"), [(100, "contact.csv"), (5_000, "solution.npz"), (10_000, "report.html")])
def test_a_run_leaves_nothing(room: int, name: str, scene: Path, tmp_path: Path) -> None:
    with room_for(room):
        refused(hvi("run", scene, "--out", tmp_path / "r", "--no-pictures"), tmp_path / "r", name)
    assert [f.name for f in tmp_path.iterdir()] == ["square.toml"]


@pytest.mark.long
def test_all_ranks_raise_the_error_of_one(scene: Path, tmp_path: Path) -> None:
    told = on_ranks(2, str(Path(__file__).parent / "full_disk_ranks.py"), scene, tmp_path)
    assert all(first == second for first, second in told)
    assert [words.partition(" could not")[0] for words, _ in told] == [
        *(f"--out {tmp_path / 'r'}: {name}" for name in ("contact.csv", "solution.npz", "report.html")),
        str(tmp_path / "piece_1.vtu"),
    ]
    assert not (tmp_path / "r").exists()
