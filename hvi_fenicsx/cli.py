"""The command line: ``hvi run | check | version``. Only what a command needs is imported, so that help is instant."""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from .errors import HviError, InputError

INTERRUPTED = 130


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
    run = commands.add_parser("run", help="solve a scene; results go to results/SCENE or --out")
    _scene_arguments(run)
    run.add_argument("--out", type=Path, metavar="DIR", help="where the result goes")
    run.add_argument("--force", action="store_true", help="replace a result that is there")
    run.add_argument("--resume", action="store_true", help="keep a finished result of the same scene, else run it")
    run.add_argument("--np", type=_ranks, metavar="N", help="run on N MPI ranks")
    run.add_argument("--petsc", default="", metavar="OPTIONS", help='PETSc options, like "-hvi_ksp_monitor"')
    run.add_argument("--no-pictures", action="store_true", help="write no pictures")
    check = commands.add_parser("check", help="validate a scene and say whether a solution exists; solves nothing")
    _scene_arguments(check)
    check.add_argument("--json", action="store_true", help="print the report as JSON")
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


def _ranks(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 4096:
        raise argparse.ArgumentTypeError(f"a number of ranks from 1 to 4096 is wanted, not {text!r}")
    return int(text)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code by the contract. Collective under mpirun."""
    words = _joined(sys.argv[1:] if arguments is None else arguments)
    try:
        return _dispatch(parser().parse_args(words), words)
    except HviError as error:
        _complain(f"hvi: {error}")
        return error.exit_code
    except KeyboardInterrupt:
        _complain("hvi: interrupted; nothing was written")
        return INTERRUPTED


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
    if getattr(options, "np", None) and not _under_mpi():
        _become_mpirun(options.np, words)
    from . import commands

    with commands.ended_together():
        return commands.run(options) if options.command == "run" else commands.check(options)


def _version() -> int:
    from .versions import versions

    if _first():
        print("\n".join(f"{name} {version}" for name, version in versions().items()))
    return 0


_RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK")


def _under_mpi() -> bool:
    return any(name in os.environ for name in _RANK_VARIABLES)


def _first() -> bool:
    """Whether this is rank 0, told by the launcher's variables: MPI itself need not be started for a message."""
    return next((os.environ[name] for name in _RANK_VARIABLES if name in os.environ), "0") == "0"


def _complain(message: str) -> None:
    if _first():
        print(message, file=sys.stderr, flush=True)


def _become_mpirun(ranks: int, words: Sequence[str]) -> NoReturn:
    """The same command under mpirun; `-m mpi4py` ends all ranks when one fails."""
    mpirun = shutil.which("mpirun")
    if mpirun is None:
        raise InputError("--np: there is no mpirun on the PATH; install Open MPI or MPICH, or leave --np out")
    at = words.index("--np") if "--np" in words else None
    rest = [w for w in words if not w.startswith("--np=")] if at is None else [*words[:at], *words[at + 2 :]]
    module = [sys.executable, "-m", "mpi4py", "-m", "hvi_fenicsx"]
    os.execv(mpirun, [mpirun, "-n", str(ranks), *module, *rest])
