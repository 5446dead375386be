"""Ends of runs by signals, as users, schedulers and a lack of memory end them."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path

SOFT = ("SIGINT", "SIGTERM", "SIGHUP")
"""Requests to stop, at the next iteration."""
TWICE = ("SIGINT twice", "SIGTERM twice", "SIGHUP twice")
"""Requests to stop at once."""
WAYS = (*SOFT, *TWICE, "SIGKILL", "one rank")
"""The last is SIGKILL to one process of a run."""
PAUSE = 0.2
"""Seconds between two signals: the first has come when the second does."""
LONGEST = 60
"""Seconds within which all processes of a run that was ended are gone."""
MARK = ("HVI_KILLS_OF", str(os.getpid()))
"""In the environment of a run and of all that it starts; this process has one run at a time."""


def started(words: list[str], environment: Mapping[str, str] | None = None) -> subprocess.Popen[str]:
    """A run in a session of its own."""
    marked = {**(os.environ if environment is None else environment), MARK[0]: MARK[1]}
    return subprocess.Popen(
        words, env=marked, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )


def end(process: subprocess.Popen[str], way: str, chance: random.Random) -> None:
    """End a run in one of the ways, and wait until its processes are gone; a request to stop is met in words."""
    there = marked()
    if way == "SIGKILL":
        os.killpg(process.pid, signal.SIGKILL)
    elif way == "one rank":
        os.kill(chance.choice(family(process.pid)), signal.SIGKILL)
    else:
        name, _, twice = way.partition(" ")
        for _ in range(2 if twice else 1):
            process.send_signal(getattr(signal, name))
            time.sleep(PAUSE)
    _, errors = process.communicate(timeout=120)
    wait_for_end(there)
    print(f"ended by {way}: {process.returncode}")
    assert "Traceback" not in errors, (way, process.args, errors)
    if way in SOFT or way in TWICE:
        # negative: before the program's own first line
        assert process.returncode in (0, 130, -getattr(signal, way.split()[0])), (way, process.args, errors)


def family(pid: int) -> list[int]:
    """The processes that a run has started, itself first."""
    found = [pid]
    for parent in found:
        found += children(parent)
    return found


def children(pid: int) -> list[int]:
    """Its child processes, while it lives."""
    try:
        return [int(c) for t in Path(f"/proc/{pid}/task").iterdir() for c in (t / "children").read_text().split()]
    except OSError:
        return []


def wait_for_end(there: set[Path]) -> None:
    """Ranks whose launcher was killed end a little later, and hold the folder until then; some start after the kill.

    Args:
        there: the processes of the run before it was ended: one that ends has no environment any more.
    """
    late = time.monotonic() + LONGEST
    while there := {process for process in there if lives(process)} | marked():
        assert time.monotonic() < late, "processes stay"
        time.sleep(0.1)


def marked() -> set[Path]:
    """The processes of a run of this one."""
    return {process for process in Path("/proc").glob("[0-9]*") if is_marked(process)}


def is_marked(process: Path) -> bool:
    """Whether a process belongs to a run of this one, by its environment."""
    try:
        return f"\0{'='.join(MARK)}\0".encode() in b"\0" + (process / "environ").read_bytes()
    except OSError:
        return False


def lives(process: Path) -> bool:
    """Whether a process may still hold files: one of its threads is no zombie."""
    try:
        states = [(task / "stat").read_text().rpartition(")")[2].split()[0] for task in (process / "task").iterdir()]
    except OSError:
        return process.exists()
    return any(state not in "ZX" for state in states)
