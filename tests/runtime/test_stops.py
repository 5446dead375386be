"""A process that is asked to stop by SIGTERM says so by its exit code, never that it was ended by SIGINT."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from types import FrameType

import pytest
from mpi4py import MPI

from hvi_fenicsx.runtime import processes
from hvi_fenicsx.runtime.mpi import ended_together

SUPPORT = Path(__file__).parents[1] / "support"
FEWEST = 100
"""Byte codes that the program runs after a first signal, or more."""


def stops(way: str) -> subprocess.CompletedProcess[str]:
    """A process that gets SIGTERM in one of the ways of ``support/stops.py``."""
    words = [sys.executable, "-m", "stops", way]
    return subprocess.run(words, cwd=SUPPORT, capture_output=True, text=True, check=False, timeout=120)


def test_a_stop_while_python_runs_a_text_ends_with_the_code_of_an_interruption() -> None:
    """Dataclasses are made so: a stop in the first moments of a run showed as SIGINT."""
    done = stops("once")
    assert (done.returncode, done.stderr) == (130, "hvi: interrupted; nothing was written\n")


@pytest.mark.long
def test_a_second_stop_never_shows_as_another_signal() -> None:
    """At each byte code from the first one on, also where the first has been caught already."""
    done = stops("twice")
    assert done.returncode == 0, done.stderr
    found = {int(code): times for code, times in json.loads(done.stdout).items()}
    assert set(found) == {130, -signal.SIGTERM}
    assert sum(found.values()) >= FEWEST


def test_ctrl_c_while_the_program_is_loaded_ends_it_without_a_traceback(tmp_path: Path) -> None:
    """In the place of the first module that it loads one that is interrupted."""
    (tmp_path / "argparse.py").write_text("import os, signal\nos.kill(os.getpid(), signal.SIGINT)\n", encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])])
    words = [sys.executable, "-P", "-m", "hvi_fenicsx", "version"]
    environment = {**os.environ, "PYTHONPATH": path}
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


def test_a_stop_that_a_library_tells_as_a_failed_import_is_an_interruption() -> None:
    """VTK's modules in C make an ImportError of a KeyboardInterrupt that comes while they load."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise ImportError

    before = signal.getsignal(signal.SIGUSR1)
    processes.catch([signal.SIGUSR1], stop)
    try:
        with pytest.raises(KeyboardInterrupt), ended_together(MPI.COMM_SELF):
            signal.raise_signal(signal.SIGUSR1)
    finally:
        signal.signal(signal.SIGUSR1, before)
        processes.forget_signals()
    with pytest.raises(ImportError), ended_together(MPI.COMM_SELF):
        raise ImportError
