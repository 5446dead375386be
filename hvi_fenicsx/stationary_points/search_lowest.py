"""The search for the lowest energy: begun, gone on with, and what is then known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import SolverError
from ..typing import Array
from .found import Found, Saved, Start, Wanted
from .length_kinds import kind_of
from .level_set import Cut
from .lowest import LowestSearch, Progress
from .point_list import StationaryPoint
from .progress_words import Clock, counted, lowest_in_words
from .scalar_problem import ScalarProblem
from .search_task import Task

STOPPED = "stopped before a first bound of the energy was known"
"""What is told where there was no time for more."""


def lowest(task: Task) -> Found:
    """The lowest energy, with a proof where it comes to its end.

    Args:
        task: the search.
    """
    problem, saved = task.problem, task.saved
    if task.wanted.no_lowest:
        return _no_lowest(task.wanted.no_lowest)
    search = LowestSearch(problem=problem, gap=_own_gap(problem, task.wanted), cut=task.stop)
    try:
        if saved is None:
            _begin(search, task.wanted.start)
        else:
            boxes = (saved[name] for name in ("low", "high", "weights", "bound"))
            search.resume(zip(*boxes, strict=True), saved["x"][0])
    except SolverError as error:
        return _no_lowest(str(error), search.boxes)
    except Cut:
        return _no_lowest(STOPPED)

    clock = Clock()

    def tell(now: Progress) -> None:
        task.report(lowest_in_words(now, task.wanted.energies, clock))
        if not search.proven:
            task.keep(lambda: _left_of_lowest(search))

    search.run(task.stop, tell)
    return _proof(search, task.wanted)


def _no_lowest(reason: str, boxes: int = 0) -> Found:
    return Found(points=(), complete=False, lower_bound=None, proven=False, nodes=boxes, reason=reason)


def _own_gap(problem: ScalarProblem, wanted: Wanted) -> float:
    """The gap that a search may leave: what the polylines of curved laws differ, on both sides, is taken off."""
    if not problem.error or wanted.start is None:
        return wanted.gap
    size, limits = abs(wanted.start.energy) or 1.0, problem.thresholds.lowest
    return max(wanted.gap - limits.sides * problem.error / size, limits.own_gap * wanted.gap)


def _begin(search: LowestSearch, known: Start | None) -> None:
    if known is None:
        search.start()
    else:
        search.resume([(known.low, known.high, np.zeros(len(search.problem.chains)), known.bound)], known.x)


def begun(
    problem: ScalarProblem,
    gap: float,
    stop: Callable[[], bool],
    report: Callable[[str], None],
    known: Start | None = None,
) -> Start | None:
    """A first search; None where there is no lowest energy, or no time for a first bound.

    Args:
        problem: of polylines near the laws.
        gap: relative gap that the search may leave.
        stop: asked before each box, and inside long steps.
        report: told how far it is, in words.
        known: where the lowest is, from polylines that were less near.
    """
    search = LowestSearch(problem=problem, gap=gap, cut=stop)
    try:
        search.start() if known is None else search.start_within(known.low, known.high, known.x)
    except (SolverError, Cut):
        return None
    search.run(stop, lambda now: report(f"first search: gap {now.gap:.1e}, {counted(now.boxes, 'box', 'boxes')}"))
    low, high = search.region
    return Start(x=search.x, energy=search.upper, low=low, high=high, bound=search.progress().lower - problem.error)


def _proof(search: LowestSearch, wanted: Wanted) -> Found:
    """What a search for the lowest energy knows; curved laws are worse by what their polylines may differ."""
    problem, now, point = search.problem, search.progress(), _lowest_point(search, wanted)
    lower = now.lower - problem.error
    proven = search.proven and 2.0 * problem.error <= (wanted.gap - search.gap) * abs(search.upper)
    left = {} if search.proven else _left_of_lowest(search)
    open_gap = max(point.energy - lower, 0.0) / (abs(point.energy) or 1.0)
    return Found(
        points=(point,),
        complete=False,
        lower_bound=lower,
        proven=proven,
        nodes=now.boxes,
        reason="the lowest energy, proven" if proven else _open_in_words(open_gap, now.waiting),
        left=left,
    )


def _lowest_point(search: LowestSearch, wanted: Wanted) -> StationaryPoint:
    """The lowest point found; a descent ends where energies are equal to rounding, so polylines are balanced."""
    problem, x = search.problem, search.x
    if wanted.exact is not None and not (problem.error or len(problem.lengths)):
        exact = wanted.exact(x)
        allowed = problem.thresholds.lowest.one_point * problem.energy_size(x)
        if exact is not None and abs(exact.energy - search.upper) <= allowed:
            return exact
    return StationaryPoint(x=x, energy=search.upper + problem.error, kind=kind_of(problem, x), isolated=True)


def _left_of_lowest(search: LowestSearch) -> Saved:
    low, high, weights, bound = (np.array(part) for part in zip(*search.open_boxes(), strict=True))
    boxes = {"low": low, "high": high, "weights": weights, "bound": bound}
    return {"lowest": np.array(True), "x": search.x[None], **boxes}


def _open_in_words(gap: float, boxes: int) -> str:
    """Why a proof is missing."""
    if boxes:
        return f"a gap of {gap:.1e} is open in {counted(boxes, 'box', 'boxes')}"
    return f"a gap of {gap:.1e} is left: the curved laws are known no better than this"


def bounded(task: Task, points: list[Array]) -> LowestSearch | None:
    """A search for the lowest energy of a few boxes, for its bound; None where there is none.

    Args:
        task: the search.
        points: that are known.
    """
    if task.wanted.no_lowest:
        return None
    search = LowestSearch(problem=task.problem, gap=task.wanted.gap, cut=task.stop)
    try:
        search.start(points)
    except (SolverError, Cut):
        return None
    search.run(lambda: search.boxes > task.most_boxes or task.stop(), lambda _: None)
    return search
