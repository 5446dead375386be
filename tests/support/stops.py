"""A command of the program that gets SIGTERM: ``python3 -m stops once``, or ``twice``, at every possible moment.

Once: while Python runs a text, as it does to make a dataclass. Twice: in a child of this process for each byte code
that the program runs after the first signal; the ends of these children are printed as JSON, each with its number.
"""

from __future__ import annotations

import collections
import io
import json
import os
import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Any

from hvi_fenicsx.commands import cli
from hvi_fenicsx.runtime import log, processes

WATCHED = {str(Path(str(module.__file__))) for module in (cli, processes, log)}
WORDS = ["run", "scene.toml", "--np", "2"]
"""A command whose ranks another program starts, in whose place something is run here."""
ESCAPED, NO_MORE = 99, 98
"""The codes of a child out of which a KeyboardInterrupt has come, and of one that ran fewer byte codes."""


class SecondSignal:
    """Sends SIGTERM before a byte code of the program, by its number from the first signal on.

    Args:
        number: of the byte code.
    """

    def __init__(self, number: int) -> None:
        self.left = number

    def watch(self) -> None:
        """Begin to count in the frames that are running now, and in later ones."""
        frame: FrameType | None = sys._getframe()
        sys.settrace(self.at)
        while frame is not None:
            frame.f_trace, frame.f_trace_opcodes = self.at, True
            frame = frame.f_back

    def at(self, frame: FrameType, event: str, _: Any) -> Any:
        """Count; a trace function of Python's."""
        frame.f_trace_opcodes = True
        if event == "opcode" and frame.f_code.co_filename in WATCHED:
            self.left -= 1
            if self.left == 0:
                signal.raise_signal(signal.SIGTERM)
        return self.at


def once(*_: object) -> int:
    """The command that is stopped while Python runs a text."""
    exec("signal.raise_signal(signal.SIGTERM)")
    return 0


def ended(number: int) -> int:
    """How a child ends that is told to stop twice: its code, or a signal as a negative number."""
    if child := os.fork():
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    second = SecondSignal(number)

    def command(*_: object) -> int:
        second.watch()
        return once()

    cli.run_under_mpirun = command
    sys.stderr = sys.stdout = io.StringIO()
    try:
        code = cli.main(WORDS)
        os._exit(code if second.left <= 0 else NO_MORE)
    except KeyboardInterrupt:
        os._exit(ESCAPED)


def twice() -> dict[int, int]:
    """How often each end was met, over all moments of the second signal."""
    found: collections.Counter[int] = collections.Counter()
    number = 1
    while (code := ended(number)) != NO_MORE:
        found[code] += 1
        number += 1
    return found


if __name__ == "__main__":
    if sys.argv[1] == "once":
        cli.run_under_mpirun = once
        raise SystemExit(cli.main(WORDS))
    print(json.dumps(twice()))
