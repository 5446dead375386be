"""The searches behind one face: all stationary points, the lowest energy, and what can be found without a proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..errors import InputError
from ..typing import Array
from . import systematic
from .all_points import Enumeration
from .boxes import fresh_box
from .found import Found, Keep, Saved, Wanted, forget
from .point_list import PointList, StationaryPoint
from .progress_words import Clock, all_in_words, counted
from .scalar_problem import ScalarProblem
from .search_lowest import bounded, lowest
from .search_task import Task
from .stationarity import Kind

NO_POINT = "no equilibrium, proven"


def find(
    problem: ScalarProblem,
    wanted: Wanted,
    stop: Callable[[], bool],
    report: Callable[[str], None],
    saved: Saved | None = None,
    keep: Keep = forget,
) -> Found:
    """All stationary points, or the lowest energy.

    Args:
        problem: the problem.
        wanted: what is asked for.
        stop: asked before each box, and inside long steps.
        report: told how far it is, in words.
        saved: what an earlier search of the same problem left.
        keep: keeps what is left while the search goes on.

    Raises:
        InputError: an earlier search was for something else.
    """
    if not problem.size:
        return _only(problem)
    if saved is not None and bool(saved["lowest"]) != wanted.lowest:
        raise InputError(
            "--resume: the search there was for something else: give or leave --lowest as then, or --force"
        )
    task = Task(problem=problem, wanted=wanted, stop=stop, report=report, saved=saved, keep=keep)
    if wanted.lowest:
        return lowest(task)
    provable = wanted.has_potential and not problem.error and not len(problem.lengths)
    return _all(task) if provable else _without_proof(task)


def _only(problem: ScalarProblem) -> Found:
    """The equilibrium of bodies without contact and laws: the minimiser of a convex energy."""
    kind = Kind.MINIMISER
    point = StationaryPoint(x=np.empty(0), energy=problem.constant, kind=kind, isolated=True)
    return Found(
        points=(point,),
        complete=True,
        lower_bound=point.energy,
        proven=True,
        nodes=0,
        reason="the only equilibrium: there is no contact and no law",
    )


def _left_of_all(search: Enumeration) -> Saved:
    boxes = {name: np.array([getattr(cell, name) for cell in search.waiting]) for name in ("low", "high", "weights")}
    points = [p.x for p in sorted(search.points, key=lambda p: p.energy)]
    found = np.array(points) if points else np.empty((0, search.problem.size))
    return {"lowest": np.array(False), "x": found, **boxes}


def _resumed(task: Task, saved: Saved) -> Enumeration:
    """A search for all points to go on with."""
    search = Enumeration(problem=task.problem, cut=task.stop)
    for x in saved["x"]:
        search.enter(x)
    low, high = saved["low"], saved["high"]
    n = search.problem.size
    cells = [fresh_box(low[i], high[i], 0.5 * (low[i] + high[i])[:n]) for i in range(len(low))]
    search.waiting = [replace(cell, share=1.0 / len(cells)) for cell in cells]
    return search


def _patience(task: Task, known: PointList) -> Callable[[], bool]:
    """Whether a search that proves nothing is over: to be asked before each attempt."""
    before, vain = len(known), 0

    def over() -> bool:
        nonlocal before, vain
        vain = vain + 1 if len(known) == before else 0
        before = len(known)
        return vain > task.problem.thresholds.systematic.most_vain or task.stop()

    return over


def _all(task: Task) -> Found:
    search = Enumeration(problem=task.problem, cut=task.stop) if task.saved is None else _resumed(task, task.saved)
    clock = Clock()

    def tell(now: Enumeration) -> None:
        task.report(all_in_words(now, clock))
        task.keep(lambda: _left_of_all(search))

    for x in task.wanted.known:
        search.enter(x)
    few = False  # a few cells often are all
    if task.saved is None:
        search.start()
        few = search.run(lambda: search.cells >= task.first_cells or task.stop(), tell)
    below = None if few else bounded(task, [p.x for p in search.points])
    if below is not None:
        search.enter(below.x)
    if task.saved is None and not few:
        over = _patience(task, search.points)
        for x in systematic.candidates(search.problem, search.points.listed, over, task.stop):
            search.enter(x)
    complete = search.run(task.stop, tell)
    points = tuple(sorted(search.points, key=lambda p: p.energy))
    bound = points[0].energy if complete and points and task.wanted.bounded else None
    bound = bound if complete or below is None else below.progress().lower
    return Found(
        points=points,
        complete=complete,
        lower_bound=bound,
        proven=complete,
        nodes=search.cells,
        reason=_in_words(points) if complete else _open_in_words(search),
        left={} if complete else _left_of_all(search),
    )


def _without_proof(task: Task) -> Found:
    """What is found where it cannot be proven that these are all."""
    problem = task.problem
    task.report("a search without a proof that nothing is missed")
    below = bounded(task, [])
    known = [*task.wanted.known, *([] if below is None else [below.x])]
    points = tuple(systematic.near_stationary(problem, known, task.stop, task.wanted.exact))
    return Found(
        points=points,
        complete=False,
        lower_bound=None if below is None else below.progress().lower - problem.error,
        proven=False,
        nodes=0 if below is None else below.boxes,
        reason=f"{len(points)} found, and there may be more: {_unproven(task)} are searched without a proof",
    )


def _unproven(task: Task) -> str:
    """The laws of which nothing is proven."""
    if not task.wanted.has_potential:
        return "laws whose energy of separation depends on the mode"
    return "laws that act on a length" if len(task.problem.lengths) else "curved laws"


def _in_words(points: tuple[StationaryPoint, ...]) -> str:
    if not points:
        return NO_POINT
    continua = sum(not p.isolated for p in points)
    return f"all equilibria, proven: {len(points)}" + (
        f", of these {counted(continua, 'stands', 'stand')} for a continuum" if continua else ""
    )


def _open_in_words(search: Enumeration) -> str:
    """What is found, and why it is not proven that this is all."""
    return f"{len(search.points)} found, and {counted(len(search.waiting), 'cell is', 'cells are')} open"


def falls_passed(problem: ScalarProblem, x: Array) -> int:
    """Number of unknowns and lengths beyond a drop of their law, or on or beyond a falling part.

    Args:
        problem: the problem.
        x: a point, (n,).
    """
    at = problem.arguments(x)
    low, high = np.minimum(at, 0.0), np.maximum(at, 0.0)
    moved = high > low
    dropped = problem.arcs.drops(low, high) > 0.0
    slopes = problem.arcs.least_slope(low, high)
    return int(np.count_nonzero(moved & (dropped | (np.isfinite(slopes) & (slopes < 0.0)))))
