"""What a run tells: records of Python's logging on rank 0, and what the command line makes of them."""

from __future__ import annotations

import itertools
import logging
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from runs import command, write_scene
from scenes import model, quadratic_linear

from hvi_fenicsx import read_tables, solve
from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.system.thresholds import Thresholds

NESTED = Thresholds(nested_from=500)
LAW = quadratic_linear(1.0e6)


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "square.toml", model(8, 3e6, friction=LAW))


def read_all(descriptor: int) -> str:
    found = b""
    while True:
        try:
            piece = os.read(descriptor, 4096)
        except OSError:  # the other end of the terminal is closed
            piece = b""
        if not piece:
            return found.decode()
        found += piece


def test_on_a_terminal_the_last_newton_step_moves_and_is_gone_in_the_end(scene: Path, tmp_path: Path) -> None:
    ours, theirs = os.openpty()
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures")
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "200"}
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=theirs, text=True, env=environment)
    os.close(theirs)
    shown, lines = read_all(ours), process.communicate()[0].splitlines()
    os.close(ours)
    assert process.returncode == 0
    assert "\x1b[2K" in shown  # the line is wiped
    assert "residual" in shown
    assert not any("residual" in line for line in lines)
    begun = [line.split()[0].rstrip(":") for line in lines[1:6]]
    assert begun == ["existence", "result", "certificate", "other", "estimated"]


def test_the_log_has_the_lines_of_the_terminal_and_every_newton_step(scene: Path, tmp_path: Path) -> None:
    words = command("run", scene, "--out", tmp_path / "r", "--no-pictures")
    lines = subprocess.run(words, check=True, capture_output=True, text=True).stdout.splitlines()
    kept = (tmp_path / "r" / "run.log").read_text(encoding="utf-8").splitlines()
    told = [line.partition(" s  ")[2] for line in kept]
    assert [line for line in told if line in lines] == lines[:-1]  # the last one tells where the folder is
    assert any("iteration 0, residual" in line for line in told)
    assert [line for line in told if ", iteration " in line][-1].endswith(", 9 vertices in contact")
    seconds = [float(line.partition(" s  ")[0]) for line in kept]
    assert seconds == sorted(seconds)


def test_an_inner_phase_does_not_count_for_the_outer_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "perf_counter", itertools.count().__next__)
    timer = Timer()
    with timer("solve"), timer("setup"):
        pass
    assert (timer.seconds["setup"], timer.seconds["solve"]) == (1, 2)


def solve_from_python(caplog: pytest.LogCaptureFixture, level: int, **keys: object) -> list[logging.LogRecord]:
    with caplog.at_level(level, logger="hvi_fenicsx"):
        solve(read_tables(model(32, 3e6, friction=LAW, **keys)), thresholds=NESTED)
    return caplog.records


def test_from_python_existence_levels_and_certificate_are_told_at_info(caplog: pytest.LogCaptureFixture) -> None:
    records = solve_from_python(caplog, logging.INFO)
    told = [(r.name, r.getMessage().partition(":")[0]) for r in records]
    assert told == [
        ("hvi_fenicsx.preparation", "2178 unknowns; existence"),
        *(("hvi_fenicsx.solvers", f"level of {n} unknowns") for n in (162, 578, 2178)),
        ("hvi_fenicsx.workflow", "certificate passed (1e-08)"),
    ]
    assert "existence: held, margin 0.333" in records[0].getMessage()


_QUIET = "from hvi_fenicsx import read_scene, solve; solve(read_scene('square.toml'))"


def test_python_users_who_configure_nothing_see_nothing(scene: Path) -> None:
    done = subprocess.run([sys.executable, "-c", _QUIET], cwd=scene.parent, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("", "")
