"""Processes that the program starts: an environment in which they are not our MPI ranks, and an end in every case.

One that reads files which may hold programs confines itself: from then on it starts none, writes no file, reaches no
network. The kernel enforces that (Landlock, Linux 5.13 and later, where it is switched on); without it only the limits
hold. Nothing here starts MPI but :func:`start_petsc`.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from types import FrameType

from ..errors import InputError, Interrupted

PYTHON = (sys.executable, "-P")
"""Python as our children run it: the current folder is not on its path."""
STOP = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""The signals by which a user, a batch system or a terminal that is closed asks a program to stop."""
SIGNALS = (*STOP, signal.SIGUSR1)
"""Those and what mpirun passes on to its ranks, and what a batch system may send before a job's end."""
_RANK = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK")
"""What mpirun tells each process, before MPI is started."""
CODE_FILE = "HVI_EXIT_CODE_FILE"
"""The variable that names a file for the ranks' exit code, where this program has started mpirun."""
_NICENESS = 10
"""The niceness of a process that stands back: it gets a tenth of the time of one that does not."""
_PR_SET_PDEATHSIG = 1
"""prctl(2)."""
_MPI = ("OMPI_", "PMIX_", "PRTE_", "PMI_", "HYDRA_", "MPI_LOCAL")
_USER_SETTINGS = (
    "OMPI_ALLOW_RUN_AS_ROOT",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM",
    "OMPI_MCA_btl",
    "OMPI_MCA_mpi_yield_when_idle",
    "OMPI_MCA_rmaps_base_oversubscribe",
    "PRTE_MCA_mapby",
    "PRTE_MCA_prte_local_tmpdir_base",
    "PRTE_MCA_prte_tmpdir_base",
    "PRTE_MCA_rmaps_default_mapping_policy",
)
"""Variables by which users (and `./hvi`) set up every mpirun; the others with these beginnings belong to one run."""
_CAUGHT: list[int] = []
"""The signals that were caught since the command began."""


def is_under_mpirun() -> bool:
    """Whether mpirun or a batch system has started this process as a rank."""
    return any(name in os.environ for name in (*_RANK, CODE_FILE))


def is_first_rank() -> bool:
    """Whether this is rank 0, or no rank."""
    return next((os.environ[name] for name in _RANK if name in os.environ), "0") == "0"


def start_petsc() -> None:
    """Start PETSc without its signal handlers, and without the options in a ``.petscrc`` of the current folder.

    Its handlers would end the program for a broken pipe or a closed terminal. Where PETSc runs already, nothing
    happens. Children inherit the same. Options in the home folder and in PETSC_OPTIONS are the user's, and hold.
    """
    given = os.environ.get("PETSC_OPTIONS", "")
    if "-no_signal_handler" not in given.split():
        os.environ["PETSC_OPTIONS"] = f"{given} -no_signal_handler".strip()
    with contextlib.chdir(Path(__file__).parent):
        from petsc4py import PETSc  # noqa: F401  (its import starts it)


def environment() -> dict[str, str]:
    """Our environment for a child, with this package on its path and without what would make it an MPI rank."""
    kept = {name: value for name, value in os.environ.items() if name in _USER_SETTINGS or not name.startswith(_MPI)}
    paths = [str(Path(__file__).parents[2]), *kept.get("PYTHONPATH", "").split(os.pathsep)]
    return {**kept, "PYTHONPATH": os.pathsep.join(filter(None, paths))}  # an empty one would be the current folder


def ensure_places() -> None:
    """Set HOME where it is missing, and TMPDIR to a folder that can be written: Open MPI does not start without them.

    Raises:
        InputError: there is no such folder.
    """
    try:
        os.environ["TMPDIR"] = tempfile.gettempdir()  # absolute
    except OSError as error:
        raise InputError(f"{error.strerror}; set TMPDIR to a folder with room") from None
    if not os.environ.get("HOME"):
        os.environ.pop("HOME", None)
        home = os.path.expanduser("~")  # by the table of users, which may lack this one
        os.environ["HOME"] = home if os.path.isdir(home) else tempfile.gettempdir()


def catch(numbers: Iterable[signal.Signals], handler: Callable[[int, FrameType | None], None]) -> None:
    """Install a handler of signals; SIGHUP stays ignored where the caller has us ignore it, as nohup does.

    Args:
        numbers: of the signals.
        handler: called for each.
    """

    def caught(number: int, frame: FrameType | None) -> None:
        _CAUGHT.append(number)
        handler(number, frame)

    for number in numbers:
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, caught)


@contextlib.contextmanager
def held(numbers: Iterable[signal.Signals]) -> Iterator[None]:
    """Let signals wait for the end of a block, also those that another thread of the process gets, as one of MPI's.

    A mask of signals would not do that: Python runs a handler in the main thread, whichever thread got the signal.

    Args:
        numbers: of the signals; those that are ignored stay so.
    """
    main = threading.current_thread() is threading.main_thread()  # Python takes handlers from it only
    known = {number: signal.getsignal(number) for number in numbers if main}
    ours = {number: now for number, now in known.items() if callable(now) or now == signal.SIG_DFL}
    came: list[int] = []
    for number in ours:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in ours.items():
            signal.signal(number, handler)
        for one in came:
            signal.raise_signal(one)


def forget_signals() -> None:
    """A command has ended, whatever interrupted it: the process ends with its exit code.

    Python remembers a KeyboardInterrupt that has passed an ``exec`` of text, as in the making of a dataclass, and ends
    a program that ``-m`` has started by SIGINT, whoever caught it. The next such ``exec`` forgets it (CPython,
    ``run_eval_code_obj``).
    """
    _CAUGHT.clear()
    exec("")


def stop_asked() -> int:
    """How many signals were caught since the command began: what fails then has failed by them, as children do."""
    return len(_CAUGHT)


def raise_on_stop() -> None:
    """Have a first stop raise KeyboardInterrupt, until a command catches them itself; a second one kills."""

    def stop(number: int, frame: FrameType | None) -> None:
        for each in STOP:
            signal.signal(each, signal.SIG_DFL)
        raise KeyboardInterrupt

    catch(STOP, stop)


def die_with_parent(number: signal.Signals = signal.SIGTERM) -> None:
    """Have this process get a signal when the one that started it is killed. Linux only.

    Nothing else would end an mpirun in a session of its own, nor a rank, which would wait for its mpirun for ever.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)


def stand_back() -> None:
    """Have this process take what the ranks leave of any of the machine's processors: mpirun may bind a rank to one."""
    os.nice(_NICENESS)
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.sched_setaffinity(0, range(os.cpu_count() or 1))


def end(child: subprocess.Popen[str]) -> None:
    """End a child that leads a process group, and its own children with it; none of them may catch SIGTERM for long.

    Args:
        child: the process.
    """
    with contextlib.suppress(OSError):
        os.killpg(child.pid, signal.SIGTERM)
    child.communicate()


_CREATE_RULESET, _RESTRICT_SELF = 444, 446
"""System calls, the same on all architectures."""
_VERSION = 1
"""landlock_create_ruleset(2): a flag to ask for the version."""
_NO_NEW_PRIVILEGES = 38
"""prctl(2)."""
_READ = 0b1100
"""Reading files and folders, among the kinds of access to files."""
_KINDS = {1: 13, 2: 14, 3: 15, 5: 16}
"""How many kinds of access to files there are, from which version on."""
_NETWORK = {4: 0b11, 6: 0b11}
"""Bind and connect over TCP; abstract sockets and signals: from which version on."""


def run(module: str, words: Sequence[str], seconds: float) -> subprocess.CompletedProcess[bytes]:
    """The process at its end, with what it has printed. Its current folder is empty, and removed in the end.

    Args:
        module: its full name; it calls :func:`die_with_parent`.
        words: its arguments.
        seconds: how long it may take.

    Raises:
        TimeoutExpired: it took longer.
        Interrupted: a signal came.
    """
    command, end = [*PYTHON, "-m", module, *words], time.monotonic() + seconds
    with tempfile.TemporaryDirectory() as folder:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env=environment(),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        with child:
            try:
                return _completed(child, end)
            finally:
                child.kill()


def _completed(child: subprocess.Popen[bytes], end: float) -> subprocess.CompletedProcess[bytes]:
    """The child at its end; until then it is seen whether a signal came."""
    while not stop_asked():
        try:
            out, err = child.communicate(timeout=0.1)
            return subprocess.CompletedProcess(child.args, child.returncode, out, err)
        except subprocess.TimeoutExpired:
            if time.monotonic() > end:
                raise
    raise Interrupted


def confine(memory: float) -> bool:
    """Forbid this process, and all that it starts, what reading needs not. There is no way back.

    Args:
        memory: what it may use, MB.

    Returns:
        Whether the kernel forbids programs, files and network; else there are the limits only.
    """
    limits = {resource.RLIMIT_AS: int(memory * 2**20), resource.RLIMIT_FSIZE: 0, resource.RLIMIT_CORE: 0}
    for kind, most in limits.items():
        _, hard = resource.getrlimit(kind)
        lowered = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(kind, (lowered, lowered))
    return sys.platform == "linux" and _restrict()


def _restrict() -> bool:
    """Handle all kinds of access but reading, and allow none of them anywhere."""
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(_VERSION))
    if version < 1:
        return False
    rules = _rules(version)
    ruleset = libc.syscall(_CREATE_RULESET, rules, ctypes.c_size_t(len(rules)), ctypes.c_uint32(0))
    if ruleset < 0:
        return False
    try:
        libc.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0)
        return bool(libc.syscall(_RESTRICT_SELF, ruleset, ctypes.c_uint32(0)) == 0)
    finally:
        os.close(ruleset)


def _rules(version: int) -> bytes:
    """What the kernel of this version shall handle, as its struct."""
    kinds = max(count for first, count in _KINDS.items() if first <= version)
    fields = [(1 << kinds) - 1 & ~_READ, *(all_of for first, all_of in _NETWORK.items() if first <= version)]
    return struct.pack(f"={len(fields)}Q", *fields)
