"""``--np N``: the same command on N ranks under mpirun, an interruption passed on as a request to stop.

Open MPI kills the ranks 0.2 s after it gets a SIGINT or SIGTERM, too soon to write what was found; it passes SIGUSR1 on
to them (mpirun(1), "Signal Propagation"; MPICH does too). So mpirun runs apart from the terminal, and for the first
signal this process sends it SIGUSR1, which :func:`.mpi.stop_on_signals` catches, for a second one SIGTERM.

mpirun prints a notice of its own when a rank ends with another code than 0, and no option silences it. So the ranks
agree on the code, rank 0 writes it into a file, and all end with 0. A broken pipe would end mpirun and so the ranks:
this process takes their lines and writes them.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import FrameType

from ..errors import ExitCode, InputError
from . import log, processes

_FOLDER = "PRTE_MCA_prte_local_tmpdir_base"
"""Where Open MPI's mpirun keeps its files, by process number: a killed one's would stop another of its number."""


def run_under_mpirun(ranks: int, words: Sequence[str]) -> int:
    """Run ``hvi WORDS`` on so many ranks; its exit code, that of an interruption after a signal.

    Args:
        ranks: how many.
        words: the command line, which may have its ``--np``.

    Raises:
        InputError: there is no mpirun, or no room for its files.
    """
    command = [*processes.launcher(ranks), "-m", "hvi_fenicsx", *words]
    try:
        folder = tempfile.TemporaryDirectory(prefix="hvi-np-", ignore_cleanup_errors=True)
    except OSError as error:
        raise InputError(f"--np: no temporary folder can be made ({error}); set TMPDIR to one with room") from None
    with folder as name:
        return _code(command, Path(name))


def _code(command: Sequence[str], folder: Path) -> int:
    """The exit code of mpirun, which keeps its files in an empty folder."""

    def pass_on(number: int, frame: FrameType | None) -> None:
        process.send_signal(signal.SIGUSR1 if processes.stop_asked() == 1 else signal.SIGTERM)

    file = folder / "code"
    file.touch()
    chosen = any(name.endswith("tmpdir_base") for name in os.environ)
    own = {processes.CODE_FILE: str(file)} | ({} if chosen else {_FOLDER: str(folder)})
    process = subprocess.Popen(
        command,
        env={**os.environ, **own},
        stdout=subprocess.PIPE,
        encoding="utf-8",
        errors="backslashreplace",
        start_new_session=True,
        preexec_fn=processes.die_with_parent,
    )
    processes.catch(processes.STOP, pass_on)
    for line in process.stdout or ():
        log.say(line.rstrip("\r\n"))
    ended, agreed = process.wait(), file.read_text(encoding="ascii")
    if processes.stop_asked() and ended and not agreed:  # before the ranks could catch it
        raise KeyboardInterrupt
    if ended and not agreed:
        room = f"where it says no more, make room in {tempfile.gettempdir()}, or set TMPDIR to another folder"
        log.complain(f"hvi: --np: mpirun ended with code {ended}; {room}")
    code = ended or int(agreed or 0)
    return ExitCode.INTERRUPTED if processes.stop_asked() and code else code


def hand_over(code: int) -> int:
    """Give the exit code that all ranks agree on to the process that started mpirun.

    Args:
        code: the same on all ranks.

    Returns:
        What this rank shall end with: 0, or the code where nobody would read the file.
    """
    if code == 0 or processes.CODE_FILE not in os.environ:
        return code
    if processes.is_first_rank():
        try:
            Path(os.environ[processes.CODE_FILE]).write_text(str(int(code)), encoding="ascii")
        except OSError:  # on another machine there is no such folder
            return code
    return 0
