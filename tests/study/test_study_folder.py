"""The folder of a study: its numbers, what is not the study's stays, it is resumed, interrupted, on a full disk."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest
from full_disk import room_for
from runs import command, hvi, write_scene
from scenes import model, quadratic_linear

from hvi_fenicsx.errors import ExitCode
from hvi_fenicsx.study.conduct import Measurement, NoReferenceError
from hvi_fenicsx.study.errors import NORMS

LAW = quadratic_linear(1e6)

ASKED = ("--axis", "epsilon=1,0.1", "--repeat", 1)


@pytest.fixture
def copy(studied: Path, tmp_path: Path) -> Path:
    shutil.copytree(studied / "out", tmp_path / "out")
    shutil.copy(studied / "square.toml", tmp_path)
    return tmp_path


def names(folder: Path) -> list[str]:
    return sorted(str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file())


def study(folder: Path, *words: object) -> Any:
    return hvi("study", folder / "square.toml", *ASKED, "--out", folder / "out", *words)


def no_reference(*_: object) -> None:
    raise NoReferenceError("none today", ExitCode.NOT_CONVERGED)


@pytest.mark.parametrize("way", ["--force", "--resume"])
def test_what_the_study_did_not_write_stays(way: str, copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No point is run here; a study that fails leaves the one that was there."""
    kept = ["holiday.png", "body.msh"]
    for name in kept:
        (copy / "out" / name).write_text("mine")
    before = {name: (copy / name).read_bytes() for name in names(copy)}
    if way == "--force":
        monkeypatch.setattr(Measurement, "run", no_reference)
    done = study(copy, way)
    if way == "--force":  # nor does it lose what it had
        assert {name: (copy / name).read_bytes() for name in names(copy)} == before
    assert all((copy / "out" / name).read_text() == "mine" for name in kept)
    assert done.returncode == (4 if way == "--force" else 0), done.stderr
    assert {"study.json", "study.csv", "report.html", "work_precision.png"} < set(names(copy / "out"))
    assert names(copy) == sorted(["square.toml", *(f"out/{n}" for n in names(copy / "out"))])


def test_folders_of_others_are_no_studies(copy: Path, tmp_path: Path) -> None:
    (copy / "out" / "manifest.json").unlink()
    before = names(copy)
    for way in ("--force", "--resume"):
        done = study(copy, way)
        assert done.returncode == 2
        assert "holds other files" in done.stderr
    assert names(copy) == before


@pytest.mark.parametrize(
    ("room", "further"),
    [(100, ()), (20_000, ()), pytest.param(6_000, ("--axis", "tolerance=1e-7"), marks=pytest.mark.long)],
)
def test_a_full_disk_ends_a_study_in_one_message_and_nothing_finished_is_lost(
    room: int, further: tuple[str, ...], copy: Path
) -> None:
    """No file may grow beyond so many bytes: the first that would is the study's own, a picture, or that of a point."""
    before = {name: (copy / "out" / name).read_bytes() for name in names(copy / "out") if name != "manifest.json"}
    with room_for(room):
        done = study(copy, "--resume", *further)
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("hvi: --out")
    assert "could not be written: File too large" in done.stderr
    after = {name: (copy / "out" / name).read_bytes() for name in before}
    assert after.pop("study.journal").startswith(before.pop("study.journal"))  # points that were finished join it
    assert after == before
    assert [name for name in names(copy) if "hvi-" in name] == []


def data(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "study.json").read_text(encoding="utf-8"))
    return found


def test_a_study_leaves_numbers_and_pictures(studied: Path) -> None:
    found = data(studied / "out")
    lines = list(csv.DictReader((studied / "out" / "study.csv").open(encoding="utf-8")))
    assert len(lines) == len(found["points"]) == 3
    for line, point in zip(lines, found["points"], strict=True):
        assert point["converged"]
        assert float(line["error_energy_norm"]) == point["errors"]["energy_norm"]
        assert float(line["seconds"]) == pytest.approx(sum(point["phases"].values()))
        assert found["own"] == found["exact"]
    assert [set(errors) for errors in found["reference"]["errors_of_coarser_meshes"]] == [set(NORMS)] * 2
    assert set(found["quantities"]) == set(NORMS)
    assert {p.name for p in (studied / "out").glob("*.png")} == {"work_precision.png", "error_epsilon.png"}


def test_a_finished_study_is_refused_or_resumed_without_running_a_point(studied: Path) -> None:
    words = ("study", studied / "square.toml", "--axis", "epsilon=1,0.1", "--out", studied / "out", "--repeat", 1)
    refused = hvi(*words)
    assert refused.returncode == 2
    assert "--resume" in refused.stderr
    journal, first = (studied / "out" / "study.journal").read_bytes(), data(studied / "out")
    assert hvi(*words, "--resume").returncode == 0
    assert (studied / "out" / "study.journal").read_bytes() == journal
    assert data(studied / "out") == first


@pytest.mark.long
def test_under_mpirun_the_points_run_on_its_ranks_and_the_errors_are_the_same(studied: Path) -> None:
    words = ("study", studied / "square.toml", "--axis", "epsilon=1,0.1", "--out", studied / "two", "--repeat", 1)
    done = hvi(*words, ranks=2)
    assert done.returncode == 0, done.stderr
    one, two = data(studied / "out"), data(studied / "two")
    assert two["ranks"] == 2
    for a, b in zip(one["points"], two["points"], strict=True):
        assert b["converged"]
        for name in NORMS:
            assert a["errors"][name] == pytest.approx(b["errors"][name], rel=1e-5, abs=1e-8), name


def test_a_scene_without_a_solution_ends_a_study(tmp_path: Path) -> None:
    pulled = model(2)
    pulled["boundary"]["press"]["traction"] = [0.0, 1.0e6]
    done = hvi("study", write_scene(tmp_path / "up.toml", pulled), "--axis", "mesh=2", "--out", tmp_path / "out")
    assert done.returncode == 3
    assert "no solution exists" in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_study_keeps_its_points_and_goes_on(tmp_path: Path, number: int) -> None:
    file = write_scene(tmp_path / "square.toml", model(4, friction=LAW))
    words = ("study", file, "--axis", "epsilon=1,0.1,0.01,0.001", "--out", tmp_path / "out", "--repeat", 1)
    child = subprocess.Popen(command(*words), stderr=subprocess.PIPE, text=True, start_new_session=True)
    journal = tmp_path / "out" / "study.journal"
    deadline = time.monotonic() + 120
    while not (journal.exists() and journal.read_bytes().count(b"\n") > 3) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.kill(child.pid, number)
    _, errors = child.communicate(timeout=60)
    assert child.returncode == 130
    assert "--resume goes on" in errors
    kept = journal.read_bytes()
    assert hvi(*words, "--resume").returncode == 0
    assert journal.read_bytes().startswith(kept)
    assert len(data(tmp_path / "out")["points"]) == 5
