"""The command line, also on N ranks (``--np N``). A command imports what it needs: help is instant.

Open MPI kills the ranks 0.2 s after it gets a SIGINT or SIGTERM, too soon to write what was found; it passes SIGUSR1 on
to them (mpirun(1), "Signal Propagation"; MPICH does too). So mpirun runs apart from the terminal, and for the first
signal this process sends it SIGUSR1, which :func:`.mpi.stop_on_signals` catches, for a second one SIGTERM.

mpirun prints a notice of its own when a rank ends with another code than 0, and no option silences it. So the ranks
agree on the code, rank 0 writes it into a file, and all end with 0. A broken pipe would end mpirun and so the ranks:
this process takes their lines and writes them.
"""

from __future__ import annotations

import argparse
import importlib
import math
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import NoReturn

from ..errors import ExitCode, HviError, InputError
from ..runtime import log, processes

_FOLDER = "PRTE_MCA_prte_local_tmpdir_base"
"""Where Open MPI's mpirun keeps its files, by process number: a killed one's would stop another of its number."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code by the contract. Collective under mpirun."""
    log.prepare()
    words = _with_petsc_joined(sys.argv[1:] if arguments is None else arguments)
    try:
        processes.raise_on_stop()
        with log.handled(log.WarningDisplay()):
            return int(_told(lambda: _dispatch(_parsed(words), words)))
    except KeyboardInterrupt:
        _print_error("hvi: interrupted; nothing was written")
        return ExitCode.INTERRUPTED
    finally:
        log.finish()
        processes.forget_signals()


def _told(command: Callable[[], int]) -> int:
    """The exit code of a command; an error of the program is told."""
    try:
        return command()
    except HviError as error:
        _print_error(f"hvi: {error}")
        return error.exit_code


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    for word in words:  # what could be written into no file of the result
        try:
            word.encode("utf-8")
        except UnicodeEncodeError:
            raise InputError(f"{word}: is not UTF-8; rename the file or folder") from None
    options = parser().parse_args(words)
    options.given = shlex.join(["hvi", *words])
    return options


def _with_petsc_joined(words: Sequence[str]) -> list[str]:
    """The command line with ``--petsc OPTIONS`` as one word: argparse would take PETSc's dashes for its own options."""
    found = list(words)
    if "--petsc" in found[:-1]:
        at = found.index("--petsc")
        found[at : at + 2] = [f"--petsc={found[at + 1]}"]
    return found


def _dispatch(options: argparse.Namespace, words: Sequence[str]) -> int:
    processes.ensure_places()
    if options.command == "version":
        return _version()
    if processes.is_under_mpirun():
        processes.die_with_parent(signal.SIGKILL)
        return hand_over(_told(lambda: _run_on_ranks(options)))
    ranks = getattr(options, "np", None)
    return run_under_mpirun(ranks, words) if ranks else _run_on_ranks(options)


def _run_on_ranks(options: argparse.Namespace) -> int:
    with processes.held(processes.STOP):  # it would end an import with a library's own traceback
        processes.start_petsc()
        from mpi4py import MPI

        from ..model import plugins
        from ..runtime.mpi import ended_together
        from ..system.petsc_options import refusals_told

        command = importlib.import_module(f".{options.command}", __package__)
    with ended_together(MPI.COMM_WORLD), _placed(options), refusals_told(), plugins.named():
        return int(command.execute(options))


@contextmanager
def _placed(options: argparse.Namespace) -> Iterator[None]:
    """Say where in the scene file a key stands that an error names."""
    from ..model import with_place

    try:
        yield
    except InputError as error:
        error.args = (with_place(str(error), options.scene, options.overrides),)  # it stays what it is
        raise


def _version() -> int:
    processes.start_petsc()
    from ..runtime.manifest import versions

    if processes.is_first_rank():
        log.say("\n".join(f"{name} {version}" for name, version in versions().items()))
    return ExitCode.CERTIFIED


def _print_error(message: str) -> None:
    if processes.is_first_rank():
        log.complain(message)


class _Parser(argparse.ArgumentParser):
    """Errors of the command line are input errors like any other: one message, exit code 2."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see `{self.prog} --help`")


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    main_parser = _Parser(
        prog="hvi",
        description="Semicoercive hemivariational inequalities: elastic bodies held by contact and nonmonotone laws.",
        epilog="Exit codes: 0 certified, 2 bad input, 3 no solution exists, 4 not converged, 130 interrupted.",
    )
    commands = main_parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    def add(name: str, text: str, *options: Callable[[argparse.ArgumentParser], None]) -> None:
        command = commands.add_parser(name, help=text, description=text)
        for one in options:
            one(command)

    add("run", "solve a scene; by default into results/SCENE", _scene, _folder, _solve, _run)
    text = "follow the equilibria of a scene over its load, through peak and unloading; by default into"
    add("path", f"{text} results/SCENE-path", _scene, _folder, _solve)
    add("check", "validate a scene and say whether a solution exists; solves nothing", _scene, _check)
    text = "find all equilibria of a scene, or the lowest with a proof; by default into results/SCENE-equilibria"
    add("equilibria", text, _scene, _folder, _solve, _equilibria)
    text = "measure what accuracy costs in time, along several axes; by default into results/SCENE-study"
    add("study", text, _scene, _folder, _study)
    add("version", "versions of everything")
    return main_parser


def _scene(command: argparse.ArgumentParser) -> None:
    """What all commands have that read a scene."""
    command.add_argument("scene", type=Path, metavar="SCENE.toml", help="the scene file")
    text = "override a value of the scene, like domain.cells=[64,64]"
    command.add_argument("--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE", help=text)


def _folder(command: argparse.ArgumentParser) -> None:
    """What all commands have that write a folder."""
    command.add_argument("--out", type=Path, metavar="DIR", help="the folder for the result")
    command.add_argument("--force", action="store_true", help="replace what is there")
    text = "keep a finished result of the same scene; else go on with what was stopped, or begin"
    command.add_argument("--resume", action="store_true", help=text)
    command.add_argument("--np", type=_ranks, metavar="N", help="run on N MPI ranks")


def _solve(command: argparse.ArgumentParser) -> None:
    """What all commands have that solve one scene into a folder."""
    text = 'PETSc options, like "-hvi_ksp_monitor"; those of the solvers begin with -hvi_'
    command.add_argument("--petsc", default="", metavar="OPTIONS", help=text)
    command.add_argument("--no-pictures", action="store_true", help="write no pictures")


def _run(run: argparse.ArgumentParser) -> None:
    text = "choose mesh, ε and tolerances so that the relative error is below REL, like 1e-2"
    run.add_argument("--accuracy", type=_relative, metavar="REL", help=text)
    run.add_argument("--quantity", metavar="NAME", help="whose error --accuracy bounds, by default energy")
    run.add_argument("--no-report", action="store_true", help="write no report.html")


def _check(check: argparse.ArgumentParser) -> None:
    text = "also print the factors of this load, the others constant: its part or region, or PART.traction"
    check.add_argument("--load", action="append", default=[], dest="loads", metavar="NAME", help=text)
    check.add_argument("--json", action="store_true", help="print the report as JSON")


def _equilibria(equilibria: argparse.ArgumentParser) -> None:
    equilibria.add_argument("--lowest", action="store_true", help="the lowest energy with a proof, instead of all")
    text = "what the proof of the lowest energy may leave open, relative to the energy; by default 1e-8"
    equilibria.add_argument("--gap", type=_relative, default=1e-8, metavar="REL", help=text)
    equilibria.add_argument("--limit", type=_seconds, metavar="SECONDS", help="stop the search after so many seconds")


def _study(study: argparse.ArgumentParser) -> None:
    text = (
        "solve the scene for each VALUE of mesh, epsilon, epsilon_absolute, smoothing, degree, method, tolerance "
        "or linear_solver; several axes: all combinations; none: the program plans the study"
    )
    study.add_argument("--axis", action="append", default=[], metavar="NAME=VALUE,...", help=text)
    text = "solve a point at most N times for its time, by default 9"
    study.add_argument("--repeat", type=_times, default=9, metavar="N", help=text)
    text = "give a point up after so many seconds, by default 120"
    study.add_argument("--limit", type=_seconds, default=120.0, metavar="SECONDS", help=text)


def _number(below: float, allowed: str, kind: Callable[[str], float] = float) -> Callable[[str], float]:
    """Reads a number above 0."""

    def read(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = math.nan
        if not 0 < value < below:
            raise argparse.ArgumentTypeError(f"must be {allowed} (is {text!r})")
        return value

    return read


_relative = _number(1.0, "a relative error between 0 and 1, like 1e-2")
_seconds = _number(math.inf, "a number of seconds above 0")
_ranks, _times = (_number(most + 1, f"a whole number from 1 to {most}, in digits like 2", int) for most in (4096, 1000))


def run_under_mpirun(ranks: int, words: Sequence[str]) -> int:
    """Run ``hvi WORDS`` on so many ranks; its exit code, that of an interruption after a signal.

    Args:
        ranks: how many.
        words: the command line, which may have its ``--np``.

    Raises:
        InputError: there is no mpirun.
    """
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        raise InputError("--np: there is no mpirun on the PATH; install Open MPI or MPICH, or leave --np out")
    # `-m mpi4py` ends all ranks when one fails.
    command = [mpirun, "-n", str(ranks), *processes.PYTHON, "-m", "mpi4py", "-m", "hvi_fenicsx", *words]
    with tempfile.TemporaryDirectory(prefix="hvi-np-", ignore_cleanup_errors=True) as name:
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
