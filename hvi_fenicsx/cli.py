"""The command line: ``hvi run | check | study | version``. A command imports what it needs: help is instant."""

from __future__ import annotations

import argparse
import math
import os
import shlex
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from .errors import ExitCode, HviError, InputError
from .runtime import processes


class _Parser(argparse.ArgumentParser):
    """Errors of the command line are input errors like any other: one message, exit code 2."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see `{self.prog} --help`")


class _RunHelp(argparse.HelpFormatter):
    """Lists the quantities, which are looked up when the help is printed: other commands need not wait for them."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        if action.dest != "quantity":
            return super()._get_help_string(action)
        from .accuracy import quantities

        return f"{action.help}; one of {', '.join(quantities.names())}, or a plugin's own"


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    main_parser = _Parser(
        prog="hvi",
        description="Semicoercive hemivariational inequalities: elastic bodies held by contact and nonmonotone laws.",
        epilog="Exit codes: 0 certified, 2 bad input, 3 no solution exists, 4 not converged, 130 interrupted.",
    )
    commands = main_parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    run = commands.add_parser(
        "run", help="solve a scene; results go to results/SCENE or --out", formatter_class=_RunHelp
    )
    _scene_arguments(run)
    run.add_argument("--out", type=Path, metavar="DIR", help="where the result goes")
    run.add_argument("--force", action="store_true", help="replace a result that is there")
    run.add_argument("--resume", action="store_true", help="keep a finished result of the same scene, else run it")
    run.add_argument(
        "--accuracy", type=_share, metavar="REL", help="choose mesh, ε and tolerances for this error: 1e-2"
    )
    run.add_argument("--quantity", metavar="NAME", help="what --accuracy is of, by default energy")
    run.add_argument("--time-budget", type=_duration, metavar="S", help="the most accurate solution within S seconds")
    run.add_argument("--np", type=_ranks, metavar="N", help="run on N MPI ranks")
    run.add_argument("--petsc", default="", metavar="OPTIONS", help='PETSc options, like "-hvi_ksp_monitor"')
    run.add_argument("--no-pictures", action="store_true", help="write no pictures")
    check = commands.add_parser("check", help="validate a scene and say whether a solution exists; solves nothing")
    _scene_arguments(check)
    check.add_argument(
        "--load",
        action="append",
        default=[],
        dest="loads",
        metavar="NAME",
        help="load factors of one load, the others constant: the part (or region) it is on, or part.traction",
    )
    check.add_argument("--json", action="store_true", help="print the report as JSON")
    _study_arguments(commands.add_parser("study", help="what accuracy costs in time: a scene along several axes"))
    commands.add_parser("version", help="versions of everything")
    return main_parser


def _scene_arguments(command: argparse.ArgumentParser) -> None:
    command.add_argument("scene", type=Path, metavar="SCENE.toml", help="the scene file")
    command.add_argument(
        "--set",
        action="append",
        default=[],
        dest="overrides",
        metavar="KEY=VALUE",
        help="override a value of the scene, like domain.cells=[64,64]",
    )


def _share(text: str) -> float:
    return _number(text, 1.0, "a relative error between 0 and 1, like 1e-2,")


def _duration(text: str) -> float:
    return _number(text, math.inf, "a number of seconds above 0")


def _number(text: str, below: float, wanted: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < below:
        raise argparse.ArgumentTypeError(f"{wanted} is wanted, not {text!r}")
    return value


def _study_arguments(study: argparse.ArgumentParser) -> None:
    _scene_arguments(study)
    study.add_argument(
        "--axis",
        action="append",
        default=[],
        metavar="NAME=VALUE,...",
        help="vary mesh, epsilon, epsilon_absolute, smoothing, method, tolerance, linear_solver or accuracy; several: "
        "all combinations; none: a plan of the program's own",
    )
    study.add_argument("--out", type=Path, metavar="DIR", help="where the study goes; else results/SCENE-study")
    study.add_argument("--force", action="store_true", help="replace a study that is there")
    study.add_argument("--resume", action="store_true", help="keep the points that are finished")
    study.add_argument("--repeat", type=_repetitions, metavar="N", help="repetitions of a point at most")
    study.add_argument("--limit", type=_duration, metavar="SECONDS", help="of a point, after which it is given up")
    study.add_argument("--np", type=_ranks, metavar="N", help="run each point on N MPI ranks")


def _repetitions(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"a number from 1 to 1000 is wanted, not {text!r}")
    return int(text)


def _ranks(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 4096:
        raise argparse.ArgumentTypeError(f"a number of ranks from 1 to 4096 is wanted, not {text!r}")
    return int(text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code by the contract. Collective under mpirun."""
    words = _joined(sys.argv[1:] if arguments is None else arguments)
    try:
        options = parser().parse_args(words)
        options.given = shlex.join(["hvi", *words])
        return _dispatch(options, words)
    except HviError as error:
        _complain(f"hvi: {error}")
        return error.exit_code
    except KeyboardInterrupt:
        _complain("hvi: interrupted; nothing was written")
        return ExitCode.INTERRUPTED


def _joined(words: Sequence[str]) -> list[str]:
    """``--petsc OPTIONS`` as one word: options begin with a dash, which argparse takes for options of its own."""
    found = list(words)
    if "--petsc" in found[:-1]:
        at = found.index("--petsc")
        found[at : at + 2] = [f"--petsc={found[at + 1]}"]
    return found


def _dispatch(options: argparse.Namespace, words: Sequence[str]) -> int:
    if options.command == "version":
        return _version()
    if options.command == "study":
        return _study(options, words)
    if getattr(options, "np", None) and not _under_mpi():
        from .runtime import mpirun

        return mpirun.run(options.np, words)
    if _under_mpi():
        processes.die_with_parent(signal.SIGKILL)
    with _undisturbed():
        from . import commands
        from .runtime.mpi import ended_together

    with ended_together(commands.COMM):
        return commands.run(options) if options.command == "run" else commands.check(options)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let Ctrl-C wait for the end of an import, which it would end in some library's own words."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _version() -> int:
    from .runtime.versions import versions

    if _first():
        print("\n".join(f"{name} {version}" for name, version in versions().items()))
    return 0


def _study(options: argparse.Namespace, words: Sequence[str]) -> int:
    """A study is one process that starts its points; under mpirun rank 0 becomes that process, the others have no part.

    None of them has started MPI yet, so that they may end as they like.
    """
    if _under_mpi():
        if not _first():
            return 0
        from .runtime import mpirun

        ranks = options.np or next((int(os.environ[n]) for n in _SIZE_VARIABLES if n in os.environ), 1)
        alone = [sys.executable, "-m", "hvi_fenicsx", *mpirun.without_ranks(words), f"--np={ranks}"]
        os.execve(sys.executable, alone, processes.environment())
    with _undisturbed():
        from .studies import study

    return study.run(options)


_SIZE_VARIABLES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")
_RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK")


def _under_mpi() -> bool:
    return any(name in os.environ for name in _RANK_VARIABLES)


def _first() -> bool:
    """Whether this is rank 0, told by the launcher's variables: MPI itself need not be started for a message."""
    return next((os.environ[name] for name in _RANK_VARIABLES if name in os.environ), "0") == "0"


def _complain(message: str) -> None:
    if _first():
        print(message, file=sys.stderr, flush=True)
