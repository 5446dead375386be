"""Result folders through the command line: what is kept, what is run again, and two runs at once."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from damage import grid, msh
from mpi4py import MPI
from runs import command, hvi, summary, write_scene
from scenes import model, quadratic_linear

from hvi_fenicsx.results import ResultFolder

TABLE = model(2, friction=quadratic_linear(1e3))


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "square.toml", TABLE)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("finished")
    assert run(write_scene(folder / "square.toml", TABLE), folder / "r").returncode == 0
    return folder


@pytest.fixture
def copy(finished: Path, tmp_path: Path) -> Path:
    """A folder of one's own with a scene and its result."""
    shutil.copytree(finished, tmp_path, dirs_exist_ok=True)
    return tmp_path


def run(scene: Path, out: Path, *words: object) -> Any:
    return hvi("run", scene, "--out", out, "--no-pictures", *words)


def names(folder: Path) -> list[str]:
    return sorted(f.name for f in folder.iterdir())


@pytest.mark.parametrize("way", ["--force", "--resume"])
def test_what_the_program_did_not_write_stays(way: str, copy: Path) -> None:
    (copy / "r" / "body.msh").write_text("mine")
    (copy / "r" / "notes").mkdir()
    for beside in (".r.old", ".r.partial", "r.old", "r.partial"):  # names that were once the program's own
        (copy / beside).mkdir()
        (copy / beside / "thesis.txt").write_text("mine")
    before, around = names(copy / "r"), names(copy)
    assert run(copy / "square.toml", copy / "r", way, "--set", "domain.cells=[3, 3]").returncode == 0
    assert summary(copy / "r")["dofs"] == 32
    assert (names(copy / "r"), names(copy)) == (before, around)
    assert (copy / "r" / "body.msh").read_text() == "mine"
    assert all((copy / beside / "thesis.txt").exists() for beside in around if beside.endswith((".old", ".partial")))


def test_a_summary_alone_makes_no_result(scene: Path, tmp_path: Path) -> None:
    """As where other programs write one, or the scene itself is with `--out .`."""
    (tmp_path / "summary.json").write_text("{}")
    for way in ("--force", "--resume"):
        done = run(scene, tmp_path, way)
        assert done.returncode == 2
        assert "holds other files" in done.stderr
    assert names(tmp_path) == ["square.toml", "summary.json"]


def test_the_scene_that_is_read_is_not_replaced(copy: Path) -> None:
    text = (copy / "r" / "scene.toml").read_text() + "\n# a note of mine\n"
    (copy / "r" / "scene.toml").write_text(text)
    done = run(copy / "r" / "scene.toml", copy / "r", "--force")
    assert done.returncode == 2
    assert "would be replaced" in done.stderr
    assert (copy / "r" / "scene.toml").read_text() == text


@pytest.mark.parametrize("name", ["contact.csv", "summary.json", "report.html", "solution.npz"])
@pytest.mark.parametrize("text", ["", "[]", None])
def test_a_damaged_result_is_not_finished(name: str, text: str | None, copy: Path) -> None:
    if text is None:
        (copy / "r" / name).unlink()
    else:
        (copy / "r" / name).write_text(text)
    done = run(copy / "square.toml", copy / "r", "--resume")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"{name} is not as it was written; the scene is run again" in done.stdout
    assert "finished already" in run(copy / "square.toml", copy / "r", "--resume").stdout


def test_a_run_into_a_folder_that_is_being_written_is_refused_at_once(scene: Path, tmp_path: Path) -> None:
    first = ResultFolder(MPI.COMM_SELF, tmp_path / "r")
    for way in ([], ["--force"], ["--resume"]):
        done = run(scene, tmp_path / "r", *way)
        assert done.returncode == 2
        assert "another run writes into it just now" in done.stderr
    first.discard()
    assert run(scene, tmp_path / "r").returncode == 0
    assert names(tmp_path) == ["r", "square.toml"]


@pytest.fixture
def from_file(tmp_path: Path) -> Path:
    """A scene whose mesh is a file in another folder."""
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "part.msh").write_bytes(msh(grid()))
    table = TABLE | {"domain": {"shape": "file", "file": str(tmp_path / "meshes" / "part.msh")}}
    return write_scene(tmp_path / "part.toml", table)


def test_a_result_of_another_mesh_is_not_finished(from_file: Path, tmp_path: Path) -> None:
    assert run(from_file, tmp_path / "r").returncode == 0
    assert "finished already" in run(from_file, tmp_path / "r", "--resume").stdout
    moved = grid()
    moved["nodes"] = [[2 * x, y, z] for x, y, z in moved["nodes"]]
    (tmp_path / "meshes" / "part.msh").write_bytes(msh(moved))
    done = run(from_file, tmp_path / "r", "--resume")
    assert "a file that the scene reads has changed" in done.stdout
    assert "finished already" not in done.stdout


@pytest.mark.long
@pytest.mark.parametrize("ranks", [1, 2])
def test_of_runs_that_start_together_one_writes_and_the_others_are_refused(
    ranks: int, scene: Path, tmp_path: Path
) -> None:
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures", "--resume", ranks=ranks)
    for _ in range(2):
        runs = [subprocess.Popen(words, stdout=-1, stderr=-1, text=True) for _ in range(3)]
        told = [one.communicate(timeout=120) for one in runs]
        codes = [one.returncode for one in runs]
        assert set(codes) <= {0, 2}
        assert 0 in codes
        for code, (out, errors) in zip(codes, told, strict=True):
            assert "Traceback" not in errors
            assert code == 0 or "another run writes into it just now" in errors, (out, errors)
        assert names(tmp_path) == ["r", "square.toml"]
        assert json.loads((tmp_path / "r" / "manifest.json").read_text())["files"].keys() == set(
            names(tmp_path / "r")
        ) - {"manifest.json"}
