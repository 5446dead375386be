"""``--np``: what is asked for, and what mpirun says or does not say. A script stands for mpirun."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from runs import ROOT, hvi, write_scene
from scenes import model


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "scene.toml", model(1))


def on_path(folder: Path, script: str) -> str:
    """A PATH whose mpirun is a shell script."""
    file = folder / "bin" / "mpirun"
    file.parent.mkdir()
    file.write_text(f"#!/bin/bash\n{script}\n", encoding="utf-8")
    file.chmod(0o755)
    return f"{file.parent}:{os.environ['PATH']}"


@contextmanager
def stopped(scene: Path, path: str) -> Iterator[subprocess.Popen[str]]:
    """A run on two ranks that got SIGTERM when its mpirun was ready."""
    out = scene.with_name("r")
    words = [sys.executable, "-m", "hvi_fenicsx", "run", str(scene), "--np", "2", "--out", str(out)]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(words, cwd=ROOT, env=os.environ | {"PATH": path}, **pipes) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        yield process


@pytest.mark.parametrize("words", ["1e3", "²", "2²", "0", "2.0", "4097", "9" * 5000, ""])
def test_a_number_of_ranks_is_in_digits(words: str, scene: Path) -> None:
    done = hvi("run", scene, f"--np={words}")
    assert done.returncode == 2
    assert "must be a whole number from 1 to 4096" in done.stderr


def test_an_mpirun_that_ends_without_a_word_is_told(
    scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Open MPI does, with 249, where the folder for temporary files is full."""
    monkeypatch.setenv("PATH", on_path(tmp_path, "exit 249"))
    done = hvi("run", scene, "--np", "2", "--out", tmp_path / "r")
    assert done.returncode == 249
    assert "mpirun ended with code 249" in done.stderr
    assert "TMPDIR" in done.stderr


def test_ranks_that_were_interrupted_are_so_when_mpirun_is_ended_without_a_word(scene: Path, tmp_path: Path) -> None:
    """The second signal comes between the last rank's end and mpirun's own."""
    code = "trap 'echo -n 130 > $HVI_EXIT_CODE_FILE; echo written' USR1; trap 'exit 1' TERM"
    path = on_path(tmp_path, f"{code}; echo ready; while true; do sleep 0.1; done")
    with stopped(scene, path) as process:
        assert process.stdout.readline() == "written\n"
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 130
        assert process.stderr.read() == ""
