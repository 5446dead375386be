"""The command line: ``hvi run | check | study | version``. A command imports what it needs: help is instant."""

from __future__ import annotations

import argparse
import math
import os
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from .errors import ExitCode, HviError, InputError
from .runtime import log, processes, rank_variables, terminal


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
    _add_run_options(_add(commands, "run", "solve a scene; results go to results/SCENE or --out", _RunHelp))
    _add_check_options(_add(commands, "check", "validate a scene and say whether a solution exists; solves nothing"))
    _add_study_options(_add(commands, "study", "measure what accuracy costs in time, along several axes"))
    _add(commands, "version", "versions of everything")
    return main_parser


def _add(
    commands: Any, name: str, text: str, formatter: type[argparse.HelpFormatter] = argparse.HelpFormatter
) -> argparse.ArgumentParser:
    return commands.add_parser(name, help=text, description=text, formatter_class=formatter)


def _add_scene_options(command: argparse.ArgumentParser) -> None:
    command.add_argument("scene", type=Path, metavar="SCENE.toml", help="the scene file")
    command.add_argument(
        "--set",
        action="append",
        default=[],
        dest="overrides",
        metavar="KEY=VALUE",
        help="override a value of the scene, like domain.cells=[64,64]",
    )


def _add_run_options(run: argparse.ArgumentParser) -> None:
    _add_scene_options(run)
    run.add_argument("--out", type=Path, metavar="DIR", help="the folder for the result")
    run.add_argument("--force", action="store_true", help="replace a result that is there")
    run.add_argument("--resume", action="store_true", help="keep a finished result of the same scene, else run it")
    run.add_argument(
        "--accuracy",
        type=_relative_error,
        metavar="REL",
        help="choose mesh, ε and tolerances so that the relative error is below REL, like 1e-2",
    )
    run.add_argument("--quantity", metavar="NAME", help="the quantity whose error --accuracy bounds, by default energy")
    run.add_argument(
        "--time-budget", type=_seconds, metavar="S", help="find the most accurate solution within S seconds"
    )
    run.add_argument("--np", type=_ranks, metavar="N", help="run on N MPI ranks")
    run.add_argument("--petsc", default="", metavar="OPTIONS", help='PETSc options, like "-hvi_ksp_monitor"')
    run.add_argument("--no-pictures", action="store_true", help="write no pictures")


def _add_check_options(check: argparse.ArgumentParser) -> None:
    _add_scene_options(check)
    check.add_argument(
        "--load",
        action="append",
        default=[],
        dest="loads",
        metavar="NAME",
        help="also print the factors of this load, the others constant: its part or region, or PART.traction",
    )
    check.add_argument("--json", action="store_true", help="print the report as JSON")


def _add_study_options(study: argparse.ArgumentParser) -> None:
    _add_scene_options(study)
    study.add_argument(
        "--axis",
        action="append",
        default=[],
        metavar="NAME=VALUE,...",
        help="solve the scene for each VALUE of mesh, epsilon, epsilon_absolute, smoothing, method, tolerance, "
        "linear_solver or accuracy; several axes: all combinations; none: the program plans the study",
    )
    study.add_argument("--out", type=Path, metavar="DIR", help="the folder for the study; else results/SCENE-study")
    study.add_argument("--force", action="store_true", help="replace a study that is there")
    study.add_argument("--resume", action="store_true", help="keep the points that are finished")
    study.add_argument("--repeat", type=_repetitions, metavar="N", help="solve a point at most N times for its time")
    study.add_argument("--limit", type=_seconds, metavar="SECONDS", help="give a point up after so many seconds")
    study.add_argument("--np", type=_ranks, metavar="N", help="run each point on N MPI ranks")


def _relative_error(text: str) -> float:
    return _number(text, 1.0, "a relative error between 0 and 1, like 1e-2")


def _seconds(text: str) -> float:
    return _number(text, math.inf, "a number of seconds above 0")


def _number(text: str, below: float, allowed: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < below:
        raise argparse.ArgumentTypeError(f"must be {allowed} (is {text!r})")
    return value


def _repetitions(text: str) -> int:
    return _whole_number(text, 1000)


def _ranks(text: str) -> int:
    return _whole_number(text, 4096)


def _whole_number(text: str, most: int) -> int:
    if not text.isdigit() or not 1 <= int(text) <= most:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 to {most} (is {text!r})")
    return int(text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code by the contract. Collective under mpirun."""
    terminal.prepare()
    processes.ensure_home()
    try:
        return int(_run_command(_with_petsc_joined(sys.argv[1:] if arguments is None else arguments)))
    finally:
        terminal.finish()


def _run_command(words: Sequence[str]) -> int:
    try:
        with log.Handlers(log.WarningDisplay()):
            return _told(lambda: _dispatch(_parsed(words), words))
    except KeyboardInterrupt:
        _print_error("hvi: interrupted; nothing was written")
        return ExitCode.INTERRUPTED


def _told(command: Callable[[], int]) -> int:
    """The exit code of a command; an error of the program is told."""
    try:
        return command()
    except HviError as error:
        _print_error(f"hvi: {error}")
        return error.exit_code


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    for word in words:
        _check_utf8(word)
    options = parser().parse_args(words)
    options.given = shlex.join(["hvi", *words])
    return options


def _check_utf8(word: str) -> None:
    """Refuse what could be written into no file of the result."""
    try:
        word.encode("utf-8")
    except UnicodeEncodeError:
        raise InputError(f"{word}: is not UTF-8; rename the file or folder") from None


def _with_petsc_joined(words: Sequence[str]) -> list[str]:
    """The command line with ``--petsc OPTIONS`` as one word: argparse would take PETSc's dashes for its own options."""
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
    if getattr(options, "np", None) and not rank_variables.is_under_mpirun():
        from .runtime import mpirun

        return mpirun.run(options.np, words)
    if not rank_variables.is_under_mpirun():
        return _run_or_check(options)
    from .runtime import mpirun

    processes.die_with_parent(signal.SIGKILL)
    return mpirun.hand_over(_told(lambda: _run_or_check(options)))


def _run_or_check(options: argparse.Namespace) -> int:
    with _interrupts_held():
        from .runtime import petsc

        petsc.start()
        from . import commands
        from .runtime.mpi import ended_together
        from .system.petsc_options import refusals_told

    with ended_together(commands.COMM), _placed(options), refusals_told():
        return commands.run(options) if options.command == "run" else commands.check(options)


@contextmanager
def _placed(options: argparse.Namespace) -> Iterator[None]:
    """Say where in the scene file a key stands that an error names."""
    from .scene import with_place

    try:
        yield
    except InputError as error:
        error.args = (with_place(str(error), options.scene, options.overrides),)  # it stays what it is, on which ranks
        raise


@contextmanager
def _interrupts_held() -> Iterator[None]:
    """Let Ctrl-C wait for the end of an import, which it would end with a library's own traceback."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _version() -> int:
    from .runtime import petsc

    petsc.start()
    from .runtime.versions import versions

    if rank_variables.is_first_rank():
        terminal.say("\n".join(f"{name} {version}" for name, version in versions().items()))
    return ExitCode.CERTIFIED


def _study(options: argparse.Namespace, words: Sequence[str]) -> int:
    """A study is one process that starts its points; under mpirun rank 0 becomes that process, the others end.

    None of them has started MPI yet, so they may end at any time.
    """
    if rank_variables.is_under_mpirun():
        if not rank_variables.is_first_rank():
            return ExitCode.CERTIFIED
        _become_single_process(options.np or rank_variables.ranks(), words)
    with _interrupts_held():
        from .studies import run as study

    return study.run(options)


def _become_single_process(ranks: int, words: Sequence[str]) -> NoReturn:
    """Replace this process, one of several ranks, by ``hvi WORDS --np RANKS`` in a process of its own."""
    from .runtime import mpirun

    alone = [*processes.PYTHON, "-m", "hvi_fenicsx", *mpirun.without_ranks(words), f"--np={ranks}"]
    os.execve(sys.executable, alone, processes.environment())


def _print_error(message: str) -> None:
    if rank_variables.is_first_rank():
        terminal.complain(message)
