"""The command line. A command imports what it needs: help is instant."""

from __future__ import annotations

import argparse
import importlib
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from ..errors import ExitCode, HviError, InputError
from ..runtime import log, processes, terminal
from .arguments import parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; the exit code by the contract. Collective under mpirun."""
    terminal.prepare()
    processes.ensure_home()
    words = _with_petsc_joined(sys.argv[1:] if arguments is None else arguments)
    try:
        processes.raise_on_stop()
        with log.handled(log.WarningDisplay()):
            return int(_told(lambda: _dispatch(_parsed(words), words)))
    except KeyboardInterrupt:
        _print_error("hvi: interrupted; nothing was written")
        return ExitCode.INTERRUPTED
    finally:
        terminal.finish()
        processes.forget_signals()


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
    if getattr(options, "np", None) and not processes.is_under_mpirun():
        from ..runtime import mpirun

        return mpirun.run(options.np, words)
    if not processes.is_under_mpirun():
        return _run_on_ranks(options)
    from ..runtime import mpirun

    processes.die_with_parent(signal.SIGKILL)
    return mpirun.hand_over(_told(lambda: _run_on_ranks(options)))


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
    from ..runtime.versions import versions

    if processes.is_first_rank():
        terminal.say("\n".join(f"{name} {version}" for name, version in versions().items()))
    return ExitCode.CERTIFIED


def _print_error(message: str) -> None:
    if processes.is_first_rank():
        terminal.complain(message)
