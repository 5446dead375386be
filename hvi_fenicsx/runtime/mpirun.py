"""``--np N``: the same command on N ranks under mpirun, an interruption passed on as a request.

Open MPI kills the ranks 0.2 s after a SIGINT or SIGTERM of its own, too soon to write what was found; SIGUSR1 it hands
on (mpirun(1), "Signal Propagation"; MPICH's does too). So mpirun runs apart from the terminal, and this process turns
the first signal into SIGUSR1, which :mod:`.signals` heeds, and a second one into SIGTERM.
"""

from __future__ import annotations

import signal
import subprocess
from collections.abc import Sequence
from types import FrameType

from ..errors import ExitCode
from . import processes


def run(ranks: int, words: Sequence[str]) -> int:
    """Run ``hvi WORDS`` on so many ranks; its exit code, that of an interruption after a signal.

    Args:
        ranks: how many.
        words: the command line, which may have its ``--np``.

    Raises:
        InputError: there is no mpirun.
    """
    command = [*processes.launcher(ranks), "-m", "hvi_fenicsx", *without_ranks(words)]
    seen: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        process.send_signal(signal.SIGUSR1 if len(seen) == 1 else signal.SIGTERM)

    process = subprocess.Popen(command, start_new_session=True, preexec_fn=processes.die_with_parent)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, note)
    code = process.wait()
    return ExitCode.INTERRUPTED if seen and code else code


def without_ranks(words: Sequence[str]) -> list[str]:
    """A command line without its ``--np``."""
    if "--np" in words:
        at = words.index("--np")
        return [*words[:at], *words[at + 2 :]]
    return [word for word in words if not word.startswith("--np=")]
