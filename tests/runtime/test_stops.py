"""A process that is asked to stop by SIGTERM says so by its exit code, never that it was ended by SIGINT."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

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
