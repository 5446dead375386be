"""A module of this package run in a process of its own, which ends with ours, at a signal to us, or after its time."""

from __future__ import annotations

import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

from ..errors import Interrupted
from . import processes
from .signals import SIGNALS


def run(module: str, words: Sequence[str], seconds: float) -> subprocess.CompletedProcess[bytes]:
    """The process at its end, with what it has printed. Its current folder is empty, and removed in the end.

    Args:
        module: its full name; it calls :func:`.processes.die_with_parent`.
        words: its arguments.
        seconds: how long it may take.

    Raises:
        TimeoutExpired: it took longer.
        Interrupted: a signal came.
    """
    command = [*processes.PYTHON, "-m", module, *words]
    with tempfile.TemporaryDirectory() as folder:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env=processes.environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        with child, _ended_by_signals(child) as signalled:
            try:
                out, err = child.communicate(timeout=seconds)
            finally:
                child.kill()
    if signalled:
        raise Interrupted
    return subprocess.CompletedProcess(command, child.returncode, out, err)


@contextmanager
def _ended_by_signals(child: subprocess.Popen[bytes]) -> Iterator[list[int]]:
    """Have signals that are handled, or would end us, end the child; the signals that came."""
    came: list[int] = []
    ours = processes.replaceable(SIGNALS)
    for number, handler in ours.items():
        signal.signal(number, _ending(child, handler, came))
    try:
        yield came
    finally:
        for number, handler in ours.items():
            signal.signal(number, handler)


def _ending(child: subprocess.Popen[bytes], handler: Any, came: list[int]) -> Callable[..., Any]:
    def end(number: int, frame: FrameType | None) -> None:
        came.append(number)
        child.kill()  # nothing where it has ended just now
        if callable(handler):
            handler(number, frame)

    return end
