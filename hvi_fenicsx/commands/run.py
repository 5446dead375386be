"""``hvi run``: a scene solved into a result folder."""

from __future__ import annotations

import argparse
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from .. import console, results
from ..errors import ExitCode, InputError
from ..load_paths import last_borne
from ..results.whole import BegunResult, begin_whole, picture_process
from ..runtime.timing import Timer
from ..workflow import Solution, find_solution, prepare
from . import session
from .session import COMM, LOG, Command, Record, Session, say

if TYPE_CHECKING:
    from ..accuracy.goal import Goal

Begin = Callable[[Solution], BegunResult]
"""Writes what pictures are drawn from, and lets them be drawn. Collective."""


def execute(options: argparse.Namespace) -> int:
    """Solve a scene into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    if options.accuracy is None and options.quantity is not None:
        raise InputError("--quantity: says what --accuracy is of; give it too")
    timer, scene = Timer(), session.scene_of(options)
    goal = None if options.accuracy is None else _goal(options)  # a plugin of the scene may define its quantity

    def done(record: Record) -> bool:
        of_run = all(record.get(other) is None for other in ("path", "equilibria"))
        ended = record["exit_code"] in (ExitCode.CERTIFIED, ExitCode.NO_SOLUTION)
        return of_run and ended and _is_of(goal, record["accuracy"])

    command = Command(suffix="", again="the scene is run again", done=done)
    return session.execute(options, scene, command, timer, lambda call: _run(call, goal))


def _goal(options: argparse.Namespace) -> Goal:
    from . import to_accuracy  # a tenth of a second, for runs that ask for it

    return to_accuracy.goal_of(options.accuracy, options.quantity)


def _is_of(goal: Goal | None, recorded: Record | None) -> bool:
    """Whether a result has the accuracy that is asked for, or none where none is."""
    if goal is None:
        return recorded is None
    from . import to_accuracy

    return to_accuracy.is_of(goal, recorded)


def _run(call: Session, goal: Goal | None) -> int:
    """Solve, write and tell; the exit code. Collective."""
    drawn = not call.options.no_pictures
    with picture_process(call.folder, call.scene.dimension, LOG.info, wanted=drawn) as pictures:
        begin = functools.partial(begin_whole, call.folder, timer=call.timer, tell=LOG.info, pictures=pictures)
        if goal is None:
            solution, begun = _solved(call, begin)
            given: dict[str, Any] = {}
        else:
            from . import to_accuracy

            reached = to_accuracy.solve(call, goal)
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
