"""``--np N``: the same command on N ranks under mpirun, an interruption passed on as a request to stop.

Open MPI kills the ranks 0.2 s after it gets a SIGINT or SIGTERM, too soon to write what was found; it passes SIGUSR1 on
to them (mpirun(1), "Signal Propagation"; MPICH does too). So mpirun runs apart from the terminal, and for the first
signal this process sends it SIGUSR1, which :mod:`.signals` catches, for a second one SIGTERM.
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
    signalled: list[int] = []

    def pass_on(number: int, frame: FrameType | None) -> None:
        signalled.append(number)
        process.send_signal(signal.SIGUSR1 if len(signalled) == 1 else signal.SIGTERM)

    process = subprocess.Popen(command, start_new_session=True, preexec_fn=processes.die_with_parent)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, pass_on)
    code = process.wait()
    return ExitCode.INTERRUPTED if signalled and code else code


def without_ranks(words: Sequence[str]) -> list[str]:
    """A command line without its ``--np``."""
    if "--np" in words:
        at = words.index("--np")
        return [*words[:at], *words[at + 2 :]]
    return [word for word in words if not word.startswith("--np=")]
