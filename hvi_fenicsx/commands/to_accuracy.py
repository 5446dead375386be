"""A run to an accuracy that is asked for; loaded only where it is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from .. import console
from ..accuracy import control, quantities
from ..accuracy.adaptive import AdaptiveSolver
from ..accuracy.goal import AccuracyResult, Goal
from ..load_paths import last_borne
from .session import COMM, LOG, Record, Session, say


def goal_of(accuracy: float, quantity: str | None) -> Goal:
    """What is asked for, by the words of the command line.

    Args:
        accuracy: relative error.
        quantity: whose error it is, by name; None: of the energy.

    Raises:
        InputError: there is no such quantity.
    """
    goal = Goal(accuracy, quantity or "energy")
    quantities.find(goal.quantity)
    return goal


def solve(call: Session, goal: Goal) -> AccuracyResult:
    """The solution of the accuracy that was asked for, and how it was reached, which is told. Collective.

    Args:
        call: of the command.
        goal: the accuracy.
    """
    solver = AdaptiveSolver(timer=call.timer, interrupted=call.interrupted)
    reached = control.solve_to_goal(call.scene, COMM, goal, solver, LOG.info)
    shown = last_borne.in_place_of(reached.level.prepared, reached.solution, call.interrupted)
    reached = replace(reached, solution=shown)
    say([*console.outcome(shown), *console.warnings(shown.warnings), *_lines(reached)])
    return reached


def is_of(goal: Goal, recorded: Record | None) -> bool:
    """Whether a summary's entry is of this goal.

    Args:
        goal: the accuracy.
        recorded: the entry ``accuracy``.
    """
    return recorded is not None and goal.as_dict().items() <= recorded.items()


def _lines(reached: AccuracyResult) -> Iterator[str]:
    """What was chosen for an accuracy, and what it cost."""
    goal, steps = reached.goal, reached.steps
    if reached.why is not None:
        yield f"accuracy not reached: {reached.why}"
    if not steps:
        return
    last, asked = steps[-1], f" ({console.share(goal.accuracy)} was asked for)"
    what = quantities.find(goal.quantity).description
    epsilon = "" if last.epsilon is None else f", ε {last.epsilon:.2g}"
    yield (
        f"accuracy: {console.share(last.error)}{asked} of {what}, at degree {reached.degree} by {len(steps)} meshes up "
        f"to {last.dofs:,} unknowns, tolerance {last.tolerance:.0e}{epsilon}, {sum(s.seconds for s in steps):.1f} s"
    )
