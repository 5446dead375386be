"""The searches behind one face: all stationary points, the lowest energy, and what can be found without a proof."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError, SolverError
from ..typing import Array
from . import systematic
from .boxes import fresh_box
from .enumeration import Enumeration
from .found import Clock, Found, Keep, Saved, Start, Wanted, all_in_words, counted, forget, lowest_in_words
from .level_set import Cut
from .lowest import LowestSearch, Progress
from .scalar_problem import ScalarProblem
from .stationarity import Kind, PointList, StationaryPoint, kind_of

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
        few = search.run(lambda: search.cells >= task.most_boxes or task.stop(), tell)
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
            _start(search, task.wanted.start)
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
    return max(wanted.gap - limits.sides * problem.error / size, limits.error_share * wanted.gap)


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
        _start(search, known)
    except (SolverError, Cut):
        return None
    search.run(stop, lambda now: report(f"first search: gap {now.gap:.1e}, {counted(now.boxes, 'box', 'boxes')}"))
    low, high = search.region
    return Start(x=search.x, energy=search.upper, low=low, high=high)


def _start(search: LowestSearch, known: Start | None) -> None:
    """Bound the whole problem, or what an earlier search has left of it."""
    if known is None:
        search.start()
    else:
        search.start([known.x], (known.low, known.high))


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
        reason="the lowest energy, proven" if proven else _gap_in_words(open_gap, now.waiting),
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


def _gap_in_words(gap: float, boxes: int) -> str:
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


@dataclass(frozen=True, kw_only=True)
class Task:
    """A search to be made: the arguments of a search."""

    problem: ScalarProblem
    wanted: Wanted
    stop: Callable[[], bool]
    report: Callable[[str], None]
    saved: Saved | None
    keep: Keep

    @property
    def most_boxes(self) -> int:
        """Boxes that are bounded for the gap where what was asked for is not proven."""
        return self.problem.thresholds.lowest.most_boxes
