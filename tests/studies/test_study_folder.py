"""The folder of a study: what is not the study's stays, one study at a time, killed points, a full disk."""

from __future__ import annotations

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

from hvi_fenicsx import read_scene
from hvi_fenicsx.report.errors import ResultError
from hvi_fenicsx.report.html import study_page
from hvi_fenicsx.results.output_folder import OutputFolder
from hvi_fenicsx.runtime import processes
from hvi_fenicsx.studies.progress import StudyProgress
from hvi_fenicsx.studies.runner import PointRun, Runner
from hvi_fenicsx.studies.setting import Setting
from hvi_fenicsx.studies.store import Store

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


def test_a_study_that_is_killed_while_its_folder_is_made_leaves_none_of_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed in the first writing to the disk; the next one may go on there."""

    class Killed(BaseException):
        pass

    def killed(_: int) -> None:
        raise Killed

    folder = OutputFolder(tmp_path / "out", "study")
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", killed)
        patched.setattr(Path, "unlink", lambda *_, **__: None)  # what follows in the killed process
        with pytest.raises(Killed):
            Store(folder.target, 1).open()
    assert names(tmp_path / "out") == [".manifest.json.part"]
    folder._lock.release(keep=True)  # as the kernel does
    again = OutputFolder(tmp_path / "out", "study")
    again.check("resume")
    Store(again.target, 1).open()
    again.close()
    assert names(tmp_path / "out") == ["manifest.json"]


@pytest.mark.parametrize("way", ["--force", "--resume"])
def test_what_the_study_did_not_write_stays(way: str, copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And what it wrote once and does not write now goes: no point is run here, they are there after --resume alone."""
    kept = ["holiday.png", "points/mine.npz", "body.msh"]
    for name in kept:
        (copy / "out" / name).write_text("mine")
    if way == "--force":
        monkeypatch.setattr(Runner, "run", lambda *_: None)
    done = study(copy, way)
    assert all((copy / "out" / name).read_text() == "mine" for name in kept)
    left = set(names(copy / "out")) - {"manifest.json", *kept}
    if way == "--force":
        assert done.returncode == 4  # there is no reference
        assert left == set()
    else:
        assert done.returncode == 0, done.stderr
        assert {"study.json", "study.csv", "report.html", "time.png"} < left
    assert names(copy) == sorted(["square.toml", *(f"out/{n}" for n in names(copy / "out"))])


def test_a_page_that_cannot_be_written_costs_a_line(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(folder: Path) -> Path:
        raise ResultError("no page today")

    monkeypatch.setattr(study_page, "write", refused)
    done = study(copy, "--resume")
    assert done.returncode == 0
    assert "warning: no page today" in done.stdout
    assert (copy / "out" / "study.json").exists()
    assert not (copy / "out" / "report.html").exists()


def test_folders_of_others_are_no_studies(copy: Path, tmp_path: Path) -> None:
    (copy / "out" / "manifest.json").unlink()
    before = names(copy)
    for way in ("--force", "--resume"):
        done = study(copy, way)
        assert done.returncode == 2
        assert "holds other files" in done.stderr
    assert names(copy) == before


def test_a_run_and_a_study_do_not_replace_each_other(copy: Path) -> None:
    done = hvi("run", copy / "square.toml", "--out", copy / "out", "--force")
    assert done.returncode == 2
    assert "holds a study" in done.stderr


def test_a_second_study_is_refused_at_once(copy: Path) -> None:
    first = OutputFolder(copy / "out", "study")
    done = study(copy, "--resume")
    first.close()
    assert done.returncode == 2
    assert "another run writes into it just now" in done.stderr


def test_a_point_that_is_killed_from_outside_is_run_again(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store(copy / "out", ranks=2)
    own = PointRun(Setting(read_scene(copy / "square.toml")))
    points = Runner(store, 1, 60.0, StudyProgress())
    for words, again in ((["kill", "-KILL", "$$"], True), (["kill", "-SEGV", "$$"], False), (["exit", "2"], False)):
        monkeypatch.setattr(processes, "launcher", lambda _, words=words: ["sh", "-c", " ".join(words)])
        store.path(own.setting).with_suffix(".json").unlink(missing_ok=True)
        points.run([own], [own])
        record = store.record(own.setting)
        assert record is not None
        assert points.finished(own) != again
        assert ("--resume runs it again" in record["reason"]) == again


@pytest.mark.parametrize(
    ("room", "further"),
    [(100, ()), (20_000, ()), pytest.param(3_000, ("--axis", "tolerance=1e-7"), marks=pytest.mark.long)],
)
def test_a_full_disk_ends_a_study_in_one_message_and_nothing_finished_is_lost(
    room: int, further: tuple[str, ...], copy: Path
) -> None:
    """No file may grow beyond so many bytes: the first that would is the study's own, a picture, or that of a point."""
    if room == 100:
        (copy / "out" / "points" / next(iter(names(copy / "out" / "points")))).unlink()
    before = {name: (copy / "out" / name).read_bytes() for name in names(copy / "out") if name != "manifest.json"}
    with room_for(room):
        done = study(copy, "--resume", *further)
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("hvi: --out")
    assert "could not be written: File too large" in done.stderr
    assert {name: (copy / "out" / name).read_bytes() for name in before} == before
    assert [name for name in names(copy) if "hvi-" in name] == []


@pytest.mark.long
def test_a_point_ends_with_its_study(tmp_path: Path) -> None:
    """Killed, a study leaves no point behind that writes beside the next one."""
    file = write_scene(tmp_path / "square.toml", model(64, friction=quadratic_linear(1e6)))
    child = subprocess.Popen(command("study", file, "--out", tmp_path / "out"), start_new_session=True)
    points = tmp_path / "out" / "points"
    deadline = time.monotonic() + 60
    while not list(points.glob("*.toml")) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.5)
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    time.sleep(0.5)
    left = subprocess.run(["pgrep", "-f", str(points)], capture_output=True, text=True, check=False).stdout
    assert left == ""
