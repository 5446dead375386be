"""The searches behind one face: all stationary points, the lowest energy, and what can be found without a proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError, SolverError
from ..typing import Array
from . import stationarity, systematic
from .enumeration import Enumeration
from .found import Found, Saved, Task, counted
from .lowest import Cut, LowestSearch, Progress
from .scalar_problem import Box, ScalarProblem
from .stationarity import Kind, PointList, StationaryPoint

NO_POINT = "no equilibrium, proven"
STOPPED = "stopped before a first bound of the energy was known"
"""What is told where there was no time for more."""


def find(task: Task) -> Found:
    """All stationary points, or the lowest energy.

    Args:
        task: the search.

    Raises:
        InputError: an earlier search was for something else.
    """
    if not task.problem.size:
        reason = "the only equilibrium: there is no contact and no law"
        return Found.only(np.empty(0), task.problem.constant, reason)
    if task.saved is not None and bool(task.saved["lowest"]) != task.lowest:
        raise InputError(
            "--resume: the search there was for something else: give or leave --lowest as then, or --force"
        )
    if task.lowest:
        return lowest(task)
    return _without_proof(task) if task.unproven else _all(task)


def _all(task: Task) -> Found:
    search = Enumeration(problem=task.problem, cut=task.stop)

    def tell(_: Enumeration) -> None:
        found = f"{len(search.points)} found, {counted(search.cells, 'cell', 'cells')}, {len(search.waiting)} open"
        task.report(f"all equilibria: {found}")
        task.keep(lambda: _left_of_all(search))

    below = None
    for x in task.known if task.saved is None else task.saved["x"]:
        search.enter(x)
    if task.saved is not None:
        boxes = list[Array](np.stack([task.saved["low"], task.saved["high"]], axis=1))
        search.waiting = [Box.around(low=box[0], high=box[1], x=box.mean(axis=0)) for box in boxes]
    else:
        search.start()
        limit = task.problem.thresholds.systematic.first_boxes
        if not search.run(lambda: search.cells >= limit or task.stop(), tell):
            if (below := _bounded(task, [p.x for p in search.points])) is not None:
                search.enter(below.x)
            for x in systematic.candidates(task.problem, search.points, task.stop):
                search.enter(x)
    complete = search.run(task.stop, tell)
    points = tuple(sorted(search.points, key=lambda p: p.energy))
    bound = None if below is None else below.progress().lower
    open_cells = counted(len(search.waiting), "cell is", "cells are")
    return Found(
        points=points,
        complete=complete,
        lower_bound=points[0].energy if complete and points and task.bounded else bound,
        proven=complete,
        nodes=search.cells,
        reason=_in_words(points) if complete else f"{len(points)} found, and {open_cells} open",
        left={} if complete else _left_of_all(search),
    )


def _left_of_all(search: Enumeration) -> Saved:
    boxes = {name: np.array([getattr(cell, name) for cell in search.waiting]) for name in ("low", "high")}
    x = np.array([p.x for p in search.points]).reshape(-1, search.problem.size)
    return {"lowest": np.array(False), "x": x, **boxes}


def _in_words(points: tuple[StationaryPoint, ...]) -> str:
    if not points:
        return NO_POINT
    continua = sum(not p.isolated for p in points)
    told = f", of these {counted(continua, 'stands', 'stand')} for a continuum" if continua else ""
    return f"all equilibria, proven: {len(points)}{told}"


def _without_proof(task: Task) -> Found:
    """What is found where it cannot be proven that these are all."""
    problem, limits = task.problem, task.problem.thresholds.systematic
    task.report("a search without a proof that nothing is missed")
    below = _bounded(task, [])
    points, tried = PointList(limits.same), PointList(limits.same)

    def enter(x: Array) -> None:
        if not tried.has(x):
            near = StationaryPoint(x=x, energy=problem.energy(x), kind=Kind.UNDECIDED)
            tried.add(near)
            points.add(near if task.exact is None else task.exact(x))

    for x in (*task.known, *([] if below is None else [below.x])):
        enter(x)
    for x in systematic.candidates(problem, points, task.stop):
        enter(x)
    return Found(
        points=tuple(sorted(points, key=lambda p: p.energy)),
        lower_bound=None if below is None else below.progress().lower - problem.error,
        nodes=0 if below is None else below.boxes,
        reason=f"{len(points)} found, and there may be more: {task.unproven} are searched without a proof",
    )


def _bounded(task: Task, points: list[Array]) -> LowestSearch | None:
    """A search for the lowest energy of a few boxes, for its bound; None where there is none."""
    if task.no_lowest:
        return None
    search = LowestSearch(problem=task.problem, gap=task.gap, cut=task.stop)
    try:
        search.start(points)
    except (SolverError, Cut):
        return None
    limit = task.problem.thresholds.systematic.first_boxes
    search.run(lambda: search.boxes > limit or task.stop(), lambda _: None)
    return search


def lowest(task: Task) -> Found:
    """The lowest energy, with a proof where it comes to its end.

    Args:
        task: the search.
    """
    if task.no_lowest:
        return Found(reason=task.no_lowest)
    search = LowestSearch(problem=task.problem, gap=task.gap, cut=task.stop)
    try:
        if task.problem.error and task.refined is not None:
            search = _refined(task, task.refined)
        if task.saved is None and not search.waiting:
            search.start()
        elif task.saved is not None:
            boxes = zip(*(list[Any](task.saved[key]) for key in ("low", "high", "bound")), strict=True)
            search.resume(boxes, task.saved["x"][0])
    except SolverError as error:
        return Found(reason=str(error), nodes=search.boxes)
    except Cut:
        return Found(reason=STOPPED)

    def tell(now: Progress) -> None:
        low, high = (f"{bound * task.unit.size:.8g}" for bound in (now.lower, now.upper))
        boxes = f"{counted(now.boxes, 'box', 'boxes')}, {now.waiting} open"
        task.report(f"lowest: between {low} and {high} {task.unit.name}, gap {now.gap:.1e}, {boxes}")
        if not search.proven:
            task.keep(lambda: _left_of_lowest(search))

    search.run(task.stop, tell)
    return _proof(task, search)


def _refined(task: Task, refined: Callable[[float, Array], ScalarProblem]) -> LowestSearch:
    """The search with polylines as near to curved laws as the gap needs, begun where a coarse search has ended."""
    limits = task.problem.thresholds.bounds
    first = LowestSearch(problem=task.problem, gap=limits.coarse_gap, cut=task.stop)
    first.start()
    first.run(task.stop, lambda now: task.report(f"first search: gap {now.gap:.1e}"))
    size = max(abs(first.upper), 1e-6 * task.problem.energy_size(first.x))
    n = task.problem.size
    problem = refined(limits.error_share * task.gap * size, np.max(np.abs(first.region), axis=0)[:n])
    left = (
        task.gap - 2.0 * (1.0 + limits.error_share) * problem.error / size
    )  # what the polylines differ on both sides, and some more
    search = LowestSearch(problem=problem, gap=max(left, limits.error_share * task.gap), cut=task.stop)
    if task.saved is None:
        search.start([first.x], first.region)
    return search


def _proof(task: Task, search: LowestSearch) -> Found:
    """What a search for the lowest energy knows; curved laws are worse by what their polylines may differ."""
    problem, now = search.problem, search.progress()
    kind = Kind.UNDECIDED if len(problem.lengths) else stationarity.kind(problem, search.x)
    point = StationaryPoint(x=search.x, energy=search.upper + problem.error, kind=kind)
    if (exact := None if task.exact is None else task.exact(search.x)) is not None:
        same = (
            abs(exact.energy - search.upper) <= problem.thresholds.points.zero * problem.energy_size(search.x)
            and not problem.error
        )
        point = exact if same else replace(point, kind=exact.kind)
    lower = now.lower - problem.error
    open_gap = max(point.energy - lower, 0.0) / (abs(point.energy) or 1.0)
    proven = search.proven and 2.0 * problem.error <= (task.gap - search.gap) * abs(search.upper)
    reason = f"a gap of {open_gap:.1e} is left: the curved laws are known no better than this"
    if not search.proven:
        reason = f"a gap of {open_gap:.1e} is open in {counted(now.waiting, 'box', 'boxes')}"
    return Found(
        points=(point,),
        lower_bound=lower,
        proven=proven,
        nodes=now.boxes,
        reason="the lowest energy, proven" if proven else reason,
        left={} if search.proven else _left_of_lowest(search),
    )


def _left_of_lowest(search: LowestSearch) -> Saved:
    low, high, bound = (np.array(part) for part in zip(*search.open_boxes(), strict=True))
    return {"lowest": np.array(True), "x": search.x[None], "low": low, "high": high, "bound": bound}


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
