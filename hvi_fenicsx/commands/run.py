"""``hvi run``: a scene solved into a result folder, also to an accuracy that is asked for."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from .. import console, results
from ..errors import ExitCode, InputError
from ..load_paths import last_borne
from ..report.page import picture_process
from ..results.whole import write_whole
from ..workflow import Solution, find_solution, prepare
from . import session
from .session import COMM, LOG, Record, Session, say

if TYPE_CHECKING:
    from ..accuracy.control import AccuracyResult, Goal  # a tenth of a second, for runs that ask for it


def execute(options: argparse.Namespace) -> int:
    """Solve a scene into a folder; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    if options.accuracy is None and options.quantity is not None:
        raise InputError("--quantity: says what --accuracy is of; give it too")

    def done(record: Record) -> bool:
        goal = _goal(options)
        accuracy = record["accuracy"]
        same = accuracy is None if goal is None else goal.as_dict().items() <= (accuracy or {}).items()
        return same and record["exit_code"] in (ExitCode.CERTIFIED, ExitCode.NO_SOLUTION)

    return session.execute(options, _run, done=done)


def _goal(options: argparse.Namespace) -> Goal | None:
    """The accuracy that is asked for; None where none is. A plugin of the scene may define its quantity."""
    if options.accuracy is None:
        return None
    from ..accuracy import control, quantities

    goal = control.Goal(options.accuracy, options.quantity or "energy")
    quantities.find(goal.quantity)
    return goal


def _run(call: Session) -> int:
    """Solve, write and tell; the exit code. Collective."""
    goal = _goal(call.options)
    options, given, drawn = call.options, call.given, not call.options.no_pictures
    with picture_process(call.folder.work) if drawn and COMM.rank == 0 else nullcontext() as process:
        if goal is None:
            solution = _solved(call)
        else:
            reached = _solved_to_goal(call, goal)
            solution = reached.solution
            given |= {"accuracy": results.plain(reached.as_dict()), "exit_code": reached.exit_code}
        record = write_whole(
            call.folder, solution, given, call.timer, LOG.info, pictures=drawn, report=not options.no_report,
            process=process,
        )  # fmt: skip
    return int(record["exit_code"])


def _solved(call: Session) -> Solution:
    """The solution with the estimate of its error, which is told; or the last state that is borne. Collective."""
    prepared = prepare(call.scene, COMM, call.timer)
    say(console.heading(prepared, COMM.size))
    found = find_solution(prepared, interrupted=call.interrupted)
    shown = last_borne.in_place_of(prepared, found.solution, call.interrupted)
    solution = found.estimated(call.interrupted) if shown is found.solution else shown
    new = (warning for warning in solution.warnings if warning not in prepared.warnings)
    say([*console.outcome(solution), *console.warnings(new)])
    return solution


def _solved_to_goal(call: Session, goal: Goal) -> AccuracyResult:
    """The solution of the accuracy that was asked for, and how it was reached, which is told. Collective."""
    from ..accuracy import adaptive, control

    solver = adaptive.AdaptiveSolver(timer=call.timer, interrupted=call.interrupted)
    reached = control.solve_to_goal(call.scene, COMM, goal, solver, LOG.info)
    shown = last_borne.in_place_of(reached.level.prepared, reached.solution, call.interrupted)
    reached = replace(reached, solution=shown)
    say([*console.outcome(shown), *console.warnings(shown.warnings), *_lines(reached)])
    return reached


def _lines(reached: AccuracyResult) -> Iterator[str]:
    """What was chosen for an accuracy, and what it cost."""
    goal, steps = reached.goal, reached.steps
    if reached.why is not None:
        yield f"accuracy not reached: {reached.why}"
    if not steps:
        return
    last, asked = steps[-1], f" ({console.share(goal.accuracy)} was asked for)"
    epsilon = "" if last.epsilon is None else f", ε {last.epsilon:.2g}"
    yield (
        f"accuracy: {console.share(last.error)}{asked} of {reached.description}, at degree {reached.degree} by "
        f"{len(steps)} meshes up to {last.dofs:,} unknowns, tolerance {last.tolerance:.0e}{epsilon}, "
        f"{sum(s.seconds for s in steps):.1f} s"
    )
