"""A process that helps ends with a signal to us, whenever that comes."""

from __future__ import annotations

import signal
import subprocess
from typing import Any

import pytest

from hvi_fenicsx.errors import Interrupted
from hvi_fenicsx.runtime import helper_process


def test_a_signal_just_after_the_end_of_the_process_is_handled(monkeypatch: pytest.MonkeyPatch) -> None:
    """There was no process to be killed any more, and that was the error of the run."""
    came: list[int] = []
    communicate = subprocess.Popen.communicate

    def late(child: subprocess.Popen[bytes], *words: Any, **named: Any) -> Any:
        ended = communicate(child, *words, **named)
        signal.raise_signal(signal.SIGUSR1)
        return ended

    monkeypatch.setattr(subprocess.Popen, "communicate", late)
    before = signal.signal(signal.SIGUSR1, lambda number, _: came.append(number))
    try:
        with pytest.raises(Interrupted):
            helper_process.run("this", [], 60.0)
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert came == [signal.SIGUSR1]
