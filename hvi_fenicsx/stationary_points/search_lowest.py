"""The search for the lowest energy: begun, gone on with, and what is then known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import SolverError
from ..typing import Array
from .found import Found, Saved, Start
from .length_kinds import kind_of
from .lowest import LowestSearch, Progress
from .point_list import StationaryPoint
from .progress_words import Clock, counted, lowest_in_words
from .scalar_problem import ScalarProblem
from .search_task import MOST_BOXES, Task, stacked

OWN_GAP = 0.85
"""Share of the gap that a search may leave where the laws are curved; the rest is for what their polylines differ."""


def lowest(task: Task) -> Found:
    """The lowest energy, with a proof where it comes to its end.

    Args:
        task: the search.
    """
    problem, saved = task.problem, task.saved
    search = LowestSearch(problem=problem, gap=task.wanted.gap * (OWN_GAP if problem.error else 1.0))
    try:
        if saved is None:
            _begin(search, task.wanted.start)
        else:
            search.resume(zip(saved["low"], saved["high"], saved["weights"], strict=True), saved["x"][0])
    except SolverError as error:
        return Found(points=(), complete=False, lower_bound=None, proven=False, nodes=search.boxes, reason=str(error))

    clock = Clock()

    def tell(now: Progress) -> None:
        task.report(lowest_in_words(now, task.wanted.energies, clock))
        if not search.proven:
            task.keep(lambda: _left_of_lowest(search))

    search.run(task.stop, tell)
    return _proof(search, task.wanted.gap)


def _begin(search: LowestSearch, known: Start | None) -> None:
    if known is None:
        search.start()
    else:
        search.resume([(known.low, known.high, np.zeros(search.problem.size))], known.x)


def begun(problem: ScalarProblem, gap: float, stop: Callable[[], bool], report: Callable[[str], None]) -> Start | None:
    """A first search; None where there is no lowest energy.

    Args:
        problem: of polylines near the laws.
        gap: relative gap that the search may leave.
        stop: asked before each box.
        report: told how far it is, in words.
    """
    search = LowestSearch(problem=problem, gap=gap)
    try:
        search.start()
    except SolverError:
        return None
    search.run(stop, lambda now: report(f"first search: gap {now.gap:.1e}, {counted(now.boxes, 'box', 'boxes')}"))
    low, high = search.region
    return Start(x=search.x, energy=search.upper, low=low, high=high)


def _proof(search: LowestSearch, wanted: float) -> Found:
    """What a search for the lowest energy knows; curved laws are worse by what their polylines may differ."""
    problem, now = search.problem, search.progress()
    point = StationaryPoint(
        x=search.x,
        energy=search.upper + problem.error,
        kind=kind_of(problem, search.x),
        isolated=True,
    )
    lower = now.lower - problem.error
    proven = search.proven and (not problem.error or point.energy - lower <= wanted * abs(point.energy))
    left = {} if search.proven else _left_of_lowest(search)
    open_gap = max(point.energy - lower, 0.0) / (abs(point.energy) or 1.0)
    return Found(
        points=(point,),
        complete=False,
        lower_bound=lower,
        proven=proven,
        nodes=now.boxes,
        reason=(
            "the lowest energy, proven"
            if proven
            else f"a gap of {open_gap:.1e} is open in {counted(now.waiting, 'box', 'boxes')}"
        ),
        left=left,
    )


def _left_of_lowest(search: LowestSearch) -> Saved:
    return {"lowest": np.array(True), "x": search.x[None], **stacked(list(search.open_boxes()))}


def bounded(task: Task, points: list[Array]) -> LowestSearch | None:
    """A search for the lowest energy of a few boxes, for its bound; None where there is none.

    Args:
        task: the search.
        points: that are known.
    """
    search = LowestSearch(problem=task.problem, gap=task.wanted.gap)
    try:
        search.start(points)
    except SolverError:
        return None
    search.run(lambda: search.boxes > MOST_BOXES or task.stop(), lambda _: None)
    return search
