"""What is written to the terminal: it commands no terminal, and an output that is closed or full costs no result."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import TextIO

import pytest
from runs import ROOT, command, process, summary, write_scene
from scenes import block, model, quadratic_linear

from hvi_fenicsx.runtime import log


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "square.toml", model(4, friction=quadratic_linear(1e3)))


def broken_pipe() -> TextIO:
    reading, writing = os.pipe()
    os.close(reading)
    return open(writing, "w", encoding="utf-8")


def test_what_is_not_printable_is_escaped() -> None:
    assert log.printable("ε = 1 µm\n") == "ε = 1 µm\n"
    assert log.printable("\x1b[31m \x7f \u202e \udce9") == r"\u001b[31m \u007f \u202e \udce9"


@pytest.mark.parametrize(
    ("output", "ranks"),
    [
        ("pipe", ()),
        pytest.param("full", (), marks=pytest.mark.long),
        pytest.param("closed", (), marks=pytest.mark.long),
        pytest.param("pipe", ("--np", "2"), marks=pytest.mark.long),
    ],
)
def test_a_run_whose_output_is_lost_writes_its_result(
    output: str, ranks: tuple[str, ...], scene: Path, tmp_path: Path
) -> None:
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures", *ranks)
    if output == "closed":
        words = ["sh", "-c", 'exec "$@" >&- 2>&-', "sh", *words]
    with broken_pipe() if output == "pipe" else open("/dev/full", "w", encoding="utf-8") as stream:
        done = subprocess.run(words, stdout=stream, stderr=subprocess.PIPE, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")
    assert summary(tmp_path / "r")["converged"]


@pytest.mark.long
@pytest.mark.parametrize("code", [2, 3, 4])
def test_ranks_end_with_the_exit_code_and_no_notice_of_mpirun(code: int, tmp_path: Path) -> None:
    table = block(3, 0.97e6, 1e6, quadratic_linear(1e6)) if code == 4 else model(4, press=-1e6 if code == 3 else 1e6)
    scene = write_scene(tmp_path / "square.toml", table)
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures", "--np", "2")
    wrong = ["--set", 'boundary.floor.contact.gap="sqrt(x - 2)"'] if code == 2 else []
    done = subprocess.run([*words, *wrong], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == code, done.stdout
    assert len(done.stderr.splitlines()) == (1 if code == 2 else 0), done.stderr


@pytest.mark.long
def test_a_point_of_a_study_that_fails_on_ranks_is_told_with_its_reason(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "square.toml", model(2, gap="sqrt(x - 2)"))
    done = process("study", scene, "--axis", "mesh=2", "--np", 2, "--out", tmp_path / "s")
    assert done.returncode == 2
    assert "not finite everywhere" in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("ranks", [(), ("--np", "2")])
def test_home_may_be_unset(ranks: tuple[str, ...], scene: Path, tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if name != "HOME"}
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures", *ranks)
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.long
@pytest.mark.parametrize("ranks", [(), ("--np", "2")])
def test_warnings_of_libraries_are_no_errors(ranks: tuple[str, ...], scene: Path, tmp_path: Path) -> None:
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures", *ranks)
    environment = os.environ | {"PYTHONWARNINGS": "error"}
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("ranks", [(), pytest.param(("--np", "2"), marks=pytest.mark.long)])
def test_files_of_the_current_folder_are_neither_run_nor_read(
    ranks: tuple[str, ...], scene: Path, tmp_path: Path
) -> None:
    """The launcher, as users call it; PYTHONPATH has an empty entry, which means the current folder."""
    (tmp_path / "typing.py").write_text("raise SystemExit('typing.py was run')", encoding="utf-8")
    (tmp_path / ".petscrc").write_text("-hvi_ksp_type nonsense", encoding="utf-8")
    for name in ("dolfinx_jit_options.json", "ffcx_options.json"):
        (tmp_path / name).write_text("no JSON", encoding="utf-8")
    environment = os.environ | {"HVI_INSIDE": "tree", "PYTHONPATH": f":{os.environ.get('PYTHONPATH', '')}:"}
    words = [str(ROOT / "hvi"), "run", str(scene), "--out", "r", "--no-pictures", *ranks]
    done = subprocess.run(
        words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=120
    )
    assert (done.returncode, done.stderr) == (0, "")
