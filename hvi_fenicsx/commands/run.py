"""``hvi run``: a scene solved into a result folder."""

from __future__ import annotations

import argparse
import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from .. import console, results
from ..accuracy import control, quantities
from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.goal import AccuracyResult, Goal
from ..errors import ExitCode, InputError
from ..load_paths import last_borne
from ..results.whole import BegunResult, begin_whole, picture_process
from ..runtime.timing import Timer
from ..workflow import Solution, find_solution, prepare
from . import session
from .session import COMM, LOG, Command, Record, Session, say

Begin = Callable[[Solution], BegunResult]
"""Writes what pictures are drawn from, and lets them be drawn. Collective."""


def execute(options: argparse.Namespace) -> int:
    """Solve a scene into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    timer, goal, scene = Timer(), _goal(options), session.scene_of(options)
    if goal is not None:
        quantities.find(goal.quantity)  # known only now: a plugin of the scene may define it

    def done(record: Record) -> bool:
        of_run = all(record.get(other) is None for other in ("path", "equilibria"))
        ended = record["exit_code"] in (ExitCode.CERTIFIED, ExitCode.NO_SOLUTION)
        return of_run and ended and _same_goal(goal, record["accuracy"])

    command = Command(suffix="", again="the scene is run again", done=done)
    return session.execute(options, scene, command, timer, lambda call: _run(call, goal))


def _goal(options: argparse.Namespace) -> Goal | None:
    """What accuracy is asked for, if one is."""
    if options.accuracy is None:
        if options.quantity is not None:
            raise InputError("--quantity: says what --accuracy is of; give it too")
        return None
    return Goal(options.accuracy, options.quantity or "energy")


def _run(call: Session, goal: Goal | None) -> int:
    """Solve, write and tell; the exit code. Collective."""
    drawn = not call.options.no_pictures
    with picture_process(call.folder, call.scene.dimension, LOG.info, wanted=drawn) as pictures:
        begin = functools.partial(begin_whole, call.folder, timer=call.timer, tell=LOG.info, pictures=pictures)
        if goal is None:
            solution, begun = _solved(call, begin)
            given: dict[str, Any] = {}
        else:
            reached = _to_goal(call, goal)
            solution, begun = reached.solution, begin(reached.solution)
            given = {"accuracy": results.plain(reached.as_dict()), "exit_code": reached.exit_code}
        record = begun.finish(solution, {**call.given, **given}, report=not call.options.no_report)
    return int(record["exit_code"])


def _solved(call: Session, begin: Begin) -> tuple[Solution, BegunResult]:
    """The solution, and its result, which is begun as soon as it can be. Collective."""
    prepared = prepare(call.scene, COMM, call.timer)
    say(console.heading(prepared, COMM.size))
    found = find_solution(prepared, interrupted=call.interrupted)
    shown = last_borne.in_place_of(prepared, found.solution, call.interrupted)
    begun = begin(shown)
    solution = found.estimated(call.interrupted) if shown is found.solution else shown
    new = (warning for warning in solution.warnings if warning not in prepared.warnings)
    say([*console.outcome(solution), *console.warnings(new)])
    return solution, begun


def _to_goal(call: Session, goal: Goal) -> AccuracyResult:
    """The solution of the accuracy that was asked for, and how it was reached. Collective."""
    solver = AdaptiveSolver(timer=call.timer, interrupted=call.interrupted)
    reached = control.solve_to_goal(call.scene, COMM, goal, solver, LOG.info)
    shown = last_borne.in_place_of(reached.level.prepared, reached.solution, call.interrupted)
    reached = replace(reached, solution=shown)
    say([*console.outcome(shown), *console.warnings(shown.warnings), *console.accuracy(reached)])
    return reached


def _same_goal(goal: Goal | None, recorded: Record | None) -> bool:
    if goal is None or recorded is None:
        return goal is None and recorded is None
    return goal.as_dict().items() <= recorded.items()
