"""The words of the command line: what each command may be given. Nothing heavy is loaded: help is instant."""

from __future__ import annotations

import argparse
import math
import re
from pathlib import Path
from typing import Any, NoReturn

from ..errors import InputError


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
    _add_run_options(_add(commands, "run", "solve a scene; results go to results/SCENE or --out"))
    _add_path_options(
        _add(commands, "path", "follow the equilibria of a scene over its load, through peak and unloading")
    )
    _add_check_options(_add(commands, "check", "validate a scene and say whether a solution exists; solves nothing"))
    text = "find all equilibria of a scene, or the lowest with a proof; by default into results/SCENE-equilibria"
    _add_equilibria_options(_add(commands, "equilibria", text))
    _add_study_options(_add(commands, "study", "measure what accuracy costs in time, along several axes"))
    _add(commands, "version", "versions of everything")
    return main_parser


def _add(commands: Any, name: str, text: str) -> argparse.ArgumentParser:
    return commands.add_parser(name, help=text, description=text)


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


def _add_solve_options(command: argparse.ArgumentParser, result: str, *, resume: str) -> None:
    """What all commands have that solve a scene into a folder."""
    _add_folder_options(command, result, resume=resume)
    command.add_argument(
        "--petsc",
        default="",
        metavar="OPTIONS",
        help='PETSc options, like "-hvi_ksp_monitor"; those of the solvers begin with -hvi_',
    )
    command.add_argument("--no-pictures", action="store_true", help="write no pictures")


def _add_folder_options(command: argparse.ArgumentParser, result: str, *, resume: str) -> None:
    command.add_argument("--out", type=Path, metavar="DIR", help=f"the folder for the {result}")
    command.add_argument("--force", action="store_true", help="replace what is there")
    command.add_argument("--resume", action="store_true", help=resume)
    command.add_argument("--np", type=_ranks, metavar="N", help="run on N MPI ranks")


def _add_run_options(run: argparse.ArgumentParser) -> None:
    _add_scene_options(run)
    run.add_argument(
        "--accuracy",
        type=_relative_error,
        metavar="REL",
        help="choose mesh, ε and tolerances so that the relative error is below REL, like 1e-2",
    )
    run.add_argument("--quantity", metavar="NAME", help="whose error --accuracy bounds, by default energy")
    run.add_argument("--no-report", action="store_true", help="write no report.html")
    _add_solve_options(
        run, "result; else results/SCENE", resume="keep a finished result of the same scene, else run it"
    )


def _add_path_options(path: argparse.ArgumentParser) -> None:
    _add_scene_options(path)
    _add_solve_options(
        path, "path; else results/SCENE-path", resume="keep a finished path, else go on from its last row"
    )


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


def _add_equilibria_options(equilibria: argparse.ArgumentParser) -> None:
    _add_scene_options(equilibria)
    equilibria.add_argument("--lowest", action="store_true", help="the lowest energy with a proof, instead of all")
    equilibria.add_argument(
        "--gap",
        type=_relative_error,
        default=1e-8,
        metavar="REL",
        help="what the proof of the lowest energy may leave open, relative to the energy; by default 1e-8",
    )
    equilibria.add_argument("--limit", type=_seconds, metavar="SECONDS", help="stop the search after so many seconds")
    _add_solve_options(
        equilibria, "results; else results/SCENE-equilibria", resume="go on with a search that was stopped"
    )


def _add_study_options(study: argparse.ArgumentParser) -> None:
    _add_scene_options(study)
    study.add_argument(
        "--axis",
        action="append",
        default=[],
        metavar="NAME=VALUE,...",
        help="solve the scene for each VALUE of mesh, epsilon, epsilon_absolute, smoothing, degree, method, "
        "tolerance, linear_solver or accuracy; several axes: all combinations; none: the program plans the study",
    )
    repeat, limit = "solve a point at most N times for its time, by default 9", "give a point up after so many seconds"
    study.add_argument("--repeat", type=_repetitions, default=9, metavar="N", help=repeat)
    study.add_argument("--limit", type=_seconds, default=120.0, metavar="SECONDS", help=f"{limit}, by default 120")
    _add_folder_options(study, "study; else results/SCENE-study", resume="keep the points that are finished")


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
    if not re.fullmatch(r"[1-9][0-9]{0,8}", text) or int(text) > most:
        raise argparse.ArgumentTypeError(f"must be a whole number from 1 to {most}, in digits like 2 (is {text!r})")
    return int(text)
