"""``hvi run``: a scene solved into a result folder."""

from __future__ import annotations

import argparse
import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from .. import console, results
from ..accuracy import control, quantities
from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.goal import AccuracyResult, Goal
from ..errors import ExitCode, InputError
from ..path import last_borne
from ..results.whole import BegunResult, begin_whole, picture_process
from ..runtime import log
from ..runtime.mpi import on_root
from ..runtime.signals import Interrupt
from ..runtime.timing import Timer
from ..scene import Scene, read_scene
from ..system import petsc_options
from ..workflow import Solution, find_solution, prepare
from . import target, telling
from .telling import COMM

Begin = Callable[[Solution], BegunResult]
"""Writes what pictures are drawn from, and lets them be drawn. Collective."""


@dataclass(frozen=True, kw_only=True)
class RunRequest:
    """What ``hvi run`` is asked for.

    Attributes:
        scene: what to solve.
        goal: the accuracy or time asked for, if any.
        folder: where the result goes.
        timer: where time goes.
        given: the command line and PETSc's options, for ``summary.json``.
        pictures: whether pictures are drawn.
        report: whether the page is written.
    """

    scene: Scene
    goal: Goal | None
    folder: results.ResultFolder
    timer: Timer
    given: dict[str, str]
    pictures: bool
    report: bool


def execute(options: argparse.Namespace) -> int:
    """Solve a scene into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    timer = Timer()
    petsc_options.insert(options.petsc)
    goal = _goal(options)
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    if goal is not None:
        quantities.find(goal.quantity)  # known only now: a plugin of the scene may define it
    goes_to = target.path_of(options)
    if options.resume and (code := _finished(goes_to, scene, goal)) is not None:
        return code
    with target.opened(options, goes_to) as folder:
        request = RunRequest(
            scene=scene,
            goal=goal,
            folder=folder,
            timer=timer,
            given=target.given(options),
            pictures=not options.no_pictures,
            report=not options.no_report,
        )
        return _run(request)


def _goal(options: argparse.Namespace) -> Goal | None:
    """What accuracy is asked for, if one is."""
    if options.accuracy is None and options.time_budget is None:
        if options.quantity is not None:
            raise InputError("--quantity: says what --accuracy or --time-budget is of; give one of them too")
        return None
    return Goal(options.accuracy, options.quantity or "energy", options.time_budget)


def _run(request: RunRequest) -> int:
    """Solve, write and tell; the exit code. Collective."""
    interrupt = Interrupt(COMM)
    interrupt.watch()
    tell = telling.LOG.info
    folder, run_logs = request.folder, telling.on_first_rank(lambda: log.RunLog(request.folder.work / "run.log"))
    with log.Handlers(*telling.on_first_rank(log.TerminalDisplay)):
        with (
            log.Handlers(*run_logs),
            picture_process(folder, request.scene.dimension, tell, wanted=request.pictures) as pictures,
        ):
            begin = functools.partial(begin_whole, folder, timer=request.timer, tell=tell, pictures=pictures)
            solution, begun, given = _solve(request, interrupt, begin)
            record = begun.finish(solution, {**request.given, **given}, report=request.report)
        on_root(COMM, lambda: telling.finish(run_logs))
        folder.commit(request.scene)
        kept = [*folder.kept, *petsc_options.unread(str(request.given["petsc"]))]
        telling.say([*console.warnings(kept), target.where(folder.target, request.timer)])
    return int(record["exit_code"])


def _solve(request: RunRequest, interrupt: Interrupt, begin: Begin) -> tuple[Solution, BegunResult, dict[str, Any]]:
    """The solution, its result, which is begun as soon as it can be, and entries of its summary. Collective."""
    if request.goal is not None:
        reached = _to_goal(request, request.goal, interrupt)
        return reached.solution, begin(reached.solution), _accuracy(reached)
    prepared = prepare(request.scene, COMM, request.timer)
    telling.say(console.heading(prepared, COMM.size))
    found = find_solution(prepared, interrupted=interrupt.requested)
    shown = last_borne.in_place_of(prepared, found.solution, interrupt.requested)
    begun = begin(shown)
    solution = found.estimated(interrupt.requested) if shown is found.solution else shown
    new = (warning for warning in solution.warnings if warning not in prepared.warnings)
    telling.say([*console.outcome(solution), *console.warnings(new)])
    return solution, begun, {}


def _to_goal(request: RunRequest, goal: Goal, interrupt: Interrupt) -> AccuracyResult:
    """The solution of the accuracy that was asked for, and how it was reached. Collective."""
    solver = AdaptiveSolver(timer=request.timer, interrupted=interrupt.requested)
    reached = control.solve_to_goal(request.scene, COMM, goal, solver, telling.LOG.info)
    shown = last_borne.in_place_of(reached.level.prepared, reached.solution, interrupt.requested)
    reached = replace(reached, solution=shown)
    telling.say([*console.outcome(shown), *console.warnings(shown.warnings), *console.accuracy(reached)])
    return reached


def _accuracy(reached: AccuracyResult) -> dict[str, Any]:
    """What differs in ``summary.json`` where an accuracy was asked for."""
    return {"accuracy": results.plain(reached.as_dict()), "exit_code": reached.exit_code}


def _finished(folder: Path, scene: Scene, goal: Goal | None) -> int | None:
    """The exit code of a finished result of the same scene and goal; None where there is none. Collective."""

    def done(record: dict[str, Any]) -> bool:
        of_run = all(record.get(other) is None for other in ("path", "equilibria"))
        ended = record["exit_code"] in (ExitCode.CERTIFIED, ExitCode.NO_SOLUTION)
        return of_run and ended and _same_goal(goal, record["accuracy"])

    return target.finished(folder, scene, "the scene is run again", done)


def _same_goal(goal: Goal | None, recorded: dict[str, Any] | None) -> bool:
    if goal is None or recorded is None:
        return goal is None and recorded is None
    return goal.as_dict().items() <= recorded.items()
