"""``--np N``: the same command on N ranks under mpirun, an interruption passed on as a request to stop.

Open MPI kills the ranks 0.2 s after it gets a SIGINT or SIGTERM, too soon to write what was found; it passes SIGUSR1 on
to them (mpirun(1), "Signal Propagation"; MPICH does too). So mpirun runs apart from the terminal, and for the first
signal this process sends it SIGUSR1, which :mod:`.signals` catches, for a second one SIGTERM.

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
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from types import FrameType

from ..errors import ExitCode, HviError, InputError
from . import processes, terminal

_CODE_FILE = "HVI_EXIT_CODE_FILE"
_ROOM = 1 << 18
"""Bytes that mpirun and the ranks need for temporary files; Open MPI ends without a word where there is no room."""
_RULE = 40 * "-"
"""The beginning of the first and the last line of a notice of mpirun's own."""
_LAST_LINES = 2.0
"""Seconds for the last lines, where a rank that was killed has left the pipe open to a child of its own."""


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
    errors = _Errors(signalled)

    def pass_on(number: int, frame: FrameType | None) -> None:
        signalled.append(number)
        process.send_signal(signal.SIGUSR1 if len(signalled) == 1 else signal.SIGTERM)

    with _code_file() as file:
        process: subprocess.Popen[str] = _started(command, file)
        processes.catch(processes.STOP, pass_on)
        writers = [_writer(process.stdout, terminal.say), _writer(process.stderr, errors.take)]
        ended, agreed = process.wait(), file.read_text(encoding="ascii")
        for writer in writers:
            writer.join(_LAST_LINES)
    if signalled and ended and not agreed:  # before the ranks could catch it; mpirun's notice of that helps nobody
        raise KeyboardInterrupt
    errors.tell_held()
    if ended and not errors.any and not signalled:
        raise HviError(
            f"--np: mpirun ended with code {ended} and without a word, as it does where the folder for temporary files "
            f"({tempfile.gettempdir()}) is full; make room there, or set TMPDIR to another folder"
        )
    code = ended or int(agreed or 0)
    return ExitCode.INTERRUPTED if signalled and code else code


class _Errors:
    """Writes what comes from standard error; after a signal mpirun's own notices wait, which stand between two rules.

    Args:
        signalled: the signals so far.

    Attributes:
        any: whether there was a line.
    """

    def __init__(self, signalled: Sequence[int]) -> None:
        self._signalled, self._held = signalled, list[str]()
        self._in_notice = self.any = False

    def take(self, line: str) -> None:
        """Write a line, or keep it."""
        self.any = True
        rule = line.startswith(_RULE)
        if rule or self._in_notice:
            self._in_notice ^= rule
            if self._signalled:
                self._held.append(line)
                return
        terminal.complain(line)

    def tell_held(self) -> None:
        """Write what was kept."""
        for line in self._held:
            terminal.complain(line)


def _started(command: Sequence[str], file: Path) -> subprocess.Popen[str]:
    """Mpirun, in a session of its own, which keeps its files beside this one; its ranks know the file."""
    return subprocess.Popen(
        command,
        env={**os.environ, **processes.session(file.parent), _CODE_FILE: str(file)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
        errors="backslashreplace",
        start_new_session=True,
        preexec_fn=processes.die_with_parent,
    )


def _writer(lines: Iterable[str] | None, write: Callable[[str], None]) -> threading.Thread:
    """A thread that writes what comes from a pipe."""

    def work() -> None:
        for line in lines or ():
            write(line.removesuffix("\n").removesuffix("\r"))

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread


@contextlib.contextmanager
def _code_file() -> Iterator[Path]:
    """An empty file for the exit code of the ranks."""
    with processes.temporary_folder("--np") as folder:
        file = folder / "code"
        try:
            file.write_bytes(bytes(_ROOM))
            file.write_bytes(b"")
        except OSError as error:
            raise InputError(f"--np: {folder}: {error.strerror}; set TMPDIR to a folder with room") from None
        yield file


def hand_over(code: int) -> int:
    """Give the exit code that all ranks agree on to the process that started mpirun.

    Collective, where MPI has been started.

    Args:
        code: the same on all ranks.

    Returns:
        What this rank shall end with: 0, or the code where nobody would read the file.
    """
    if code == 0 or _CODE_FILE not in os.environ:
        return code
    from mpi4py import MPI

    comm = MPI.COMM_WORLD
    written = comm.bcast(_written(os.environ[_CODE_FILE], code) if comm.rank == 0 else False)
    return 0 if written else code


def _written(file: str, code: int) -> bool:
    """Write the code into a file that is there; on another machine it is not."""
    with contextlib.suppress(OSError), open(file, "r+", encoding="ascii") as stream:
        stream.write(str(int(code)))
        return True
    return False


def without_ranks(words: Sequence[str]) -> list[str]:
    """A command line without its ``--np``."""
    if "--np" in words:
        at = words.index("--np")
        return [*words[:at], *words[at + 2 :]]
    return [word for word in words if not word.startswith("--np=")]
