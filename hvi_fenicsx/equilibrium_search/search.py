"""The searches behind one face: what is asked, and what all stationary points or the lowest energy are found to be."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ..errors import InputError, SolverError
from ..typing import Array
from . import stationarity
from .enumeration import Enumeration
from .lowest import Cut, LowestSearch, descend
from .scalar_problem import Box, ScalarProblem
from .stationarity import Kind, PointList, StationaryPoint
from .thresholds import LIMITS

Saved = Mapping[str, Array]
"""What is left of an unfinished search: arrays, by name."""
Keep = Callable[[Callable[[], Saved]], None]
"""Is given, after each box, what makes the state to go on from."""
Refined = Callable[[float, Array], ScalarProblem]
"""A problem with polylines nearer to curved laws: by the difference of the energies and where it counts, (n,)."""
NO_POINT = "no equilibrium, proven"
OTHER = "--resume: the search there was for something else: give or leave --lowest as then, or --force"
"""What is told of a search that cannot be gone on with."""
STOPPED = "stopped before a first bound of the energy was known"
"""What is told where there was no time for more."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A search to be made.

    Attributes:
        problem: the problem.
        lowest: the lowest energy with a proof; else all equilibria.
        gap: relative gap that the proof of the lowest may leave.
        stop: asked before each box, and inside long steps.
        report: told how far it is, in words.
        saved: what an earlier search of the same problem left.
        keep: keeps what is left while the search goes on.
        bounded: whether the energy is known to be bounded from below.
        has_potential: whether all laws are derivatives of an energy.
        no_lowest: why there is no lowest energy; empty where there may be one.
        known: points near which equilibria are known to be, (n,) each.
        exact: makes a point near an equilibrium exact; None where there is none near it.
        refined: follows curved laws more closely.
    """

    problem: ScalarProblem
    lowest: bool = False
    gap: float = 1e-8
    stop: Callable[[], bool] = lambda: False
    report: Callable[[str], None] = lambda _: None
    saved: Saved | None = None
    keep: Keep = lambda _: None
    bounded: bool = True
    has_potential: bool = True
    no_lowest: str = ""
    known: tuple[Array, ...] = ()
    exact: Callable[[Array], StationaryPoint | None] | None = None
    refined: Refined | None = None

    @property
    def unproven(self) -> str:
        """The laws of which it cannot be proven that all equilibria are found; empty where there are none."""
        if not self.has_potential:
            return "laws whose energy of separation depends on the mode"
        if len(self.problem.lengths):
            return "laws that act on a length"
        return "curved laws" if self.problem.error else ""

    def made_exact(self, places: Iterable[Array]) -> tuple[StationaryPoint, ...]:
        """Different stationary points near places, by energy.

        Args:
            places: each (n,).
        """
        points, tried = (PointList(LIMITS.accuracy**0.5) for _ in range(2))
        for x in places:
            near = StationaryPoint(x=x, energy=self.problem.energy(x), kind=Kind.UNDECIDED)
            if tried.add(near):
                points.add(near if self.exact is None else self.exact(x))
        return by_energy(points)


@dataclass(frozen=True, kw_only=True)
class Found:
    """What a search found.

    Attributes:
        points: by energy.
        complete: whether these are all stationary points.
        lower_bound: no point has a lower energy; None where none is known.
        proven: whether what was asked for is proven.
        nodes: boxes that were bounded or tested.
        reason: how it ended, for people.
        left: what is needed to go on; empty if there is nothing left.
    """

    points: tuple[StationaryPoint, ...] = ()
    complete: bool = False
    lower_bound: float | None = None
    proven: bool = False
    nodes: int = 0
    reason: str
    left: Saved = field(default_factory=dict)

    @classmethod
    def only(cls, x: Array, energy: float, reason: str) -> Found:
        """The only equilibrium, proven.

        Args:
            x: where it is, (n,).
            energy: there.
            reason: how it is proven.
        """
        point = StationaryPoint(x=x, energy=energy, kind=Kind.MINIMISER)
        return cls(points=(point,), complete=True, lower_bound=energy, proven=True, reason=reason)

    @property
    def gap(self) -> float | None:
        """Lowest energy found minus lower bound, relative to that energy; None where there is no bound."""
        if self.lower_bound is None or not self.points:
            return None
        lowest = self.points[0].energy
        return max(lowest - self.lower_bound, 0.0) / (abs(lowest) or 1.0)


def counted(count: int, one: str, several: str) -> str:
    """A number with the words for what is counted.

    Args:
        count: the number.
        one: words for one.
        several: words for another number.
    """
    return f"{count} {one if count == 1 else several}"


def by_energy(points: Iterable[StationaryPoint]) -> tuple[StationaryPoint, ...]:
    """Points, the lowest first.

    Args:
        points: in any order.
    """
    return tuple(sorted(points, key=lambda p: p.energy))


def find(task: Task) -> Found:
    """All stationary points, or the lowest energy.

    Args:
        task: the search.

    Raises:
        InputError: an earlier search was for something else.
    """
    if not task.problem.size:
        reason = "the only equilibrium, but for rigid motions that the supports leave: there is no contact and no law"
        return Found.only(np.empty(0), task.problem.constant, reason)
    if task.saved is not None and bool(task.saved["lowest"]) != task.lowest:
        raise InputError(OTHER)
    if task.lowest:
        return lowest(task)
    return _of_lengths(task) if len(task.problem.lengths) else _all(task)


def _all(task: Task) -> Found:
    """All points of polylines, proven; those of curved laws are near them."""
    problem, search, below = task.problem, Enumeration(problem=task.problem, cut=task.stop), None
    known: list[Array] = [*task.known] if task.saved is None else [*task.saved["x"]]

    def tell(_: Enumeration) -> None:
        found = f"{len(search.points)} found, {counted(search.cells, 'cell', 'cells')}, {len(search.waiting)} open"
        task.report(f"all equilibria: {found}")
        task.keep(lambda: _left_of_all(search, known))

    for x in known:
        search.enter(x)
    if task.saved is not None:
        boxes: Array = np.stack([task.saved["low"], task.saved["high"]], axis=1)
        search.waiting = [Box.around(low=box[0], high=box[1], x=0.5 * (box[0] + box[1])) for box in boxes]
    else:
        search.start()
        if (
            not search.run(lambda: search.cells >= LIMITS.first_boxes or task.stop(), tell)
            and (below := _bounded(task)) is not None
        ):
            search.enter(below.x)
    complete = search.run(task.stop, tell)
    points = by_energy(search.points)
    bound = None if below is None else below.lower - problem.error
    if complete and points and task.bounded:
        bound = points[0].energy - problem.error
    if task.unproven:
        points = task.made_exact([*known, *(p.x for p in points)])
    return Found(
        points=points,
        complete=complete and not task.unproven,
        lower_bound=bound,
        proven=complete and not task.unproven,
        nodes=search.cells,
        reason=_in_words(task, points, len(search.waiting)),
        left={} if complete else _left_of_all(search, known),
    )


def few_boxes(problem: ScalarProblem, stop: Callable[[], bool]) -> list[StationaryPoint]:
    """The stationary points of a search that ends at the first minimiser, or after few boxes; minimisers first.

    Args:
        problem: the problem; there are none of laws of a length.
        stop: asked before each box.
    """
    search = Enumeration(problem=problem, cut=stop)

    def enough() -> bool:
        return stop() or search.cells >= LIMITS.few_boxes or any(p.kind is Kind.MINIMISER for p in search.points)

    if not len(problem.lengths):
        search.start()
        search.run(enough, lambda _: None)
    return sorted(search.points, key=lambda point: (point.kind is not Kind.MINIMISER, point.energy))


def _left_of_all(search: Enumeration, known: Iterable[Array]) -> Saved:
    boxes = {name: np.array([getattr(cell, name) for cell in search.waiting]) for name in ("low", "high")}
    x = np.array([*known, *(p.x for p in search.points)]).reshape(-1, search.problem.size)
    return {"lowest": np.array(False), "x": x, **boxes}


def _in_words(task: Task, points: tuple[StationaryPoint, ...], waiting: int) -> str:
    if task.unproven:
        return f"{len(points)} found, and there may be more: {task.unproven} are searched without a proof"
    if waiting:
        return f"{len(points)} found, and {counted(waiting, 'cell is', 'cells are')} open"
    if not points:
        return NO_POINT
    continua = sum(not p.isolated for p in points)
    told = f", of these {counted(continua, 'stands', 'stand')} for a continuum" if continua else ""
    return f"all equilibria, proven: {len(points)}{told}"


def _of_lengths(task: Task) -> Found:
    """What is found from several loads, where it cannot be proven that these are all."""
    task.report("a search without a proof that nothing is missed")
    below = _bounded(task)
    starts = [*task.known, *([] if below is None else [below.x])]
    points = task.made_exact([*starts, *loaded_states(task.problem, task.stop)])
    return Found(
        points=points,
        lower_bound=None if below is None else below.lower - task.problem.error,
        nodes=0 if below is None else below.boxes,
        reason=_in_words(task, points, 0),
    )


def _bounded(task: Task) -> LowestSearch | None:
    """A search for the lowest energy of a few boxes, for its bound; None where there is none."""
    if task.no_lowest:
        return None
    search = LowestSearch(problem=task.problem, gap=task.gap, cut=task.stop)
    try:
        search.start()
    except (SolverError, Cut):
        return None
    search.run(lambda: search.boxes > LIMITS.first_boxes or task.stop(), lambda _: None)
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

    def tell(_: LowestSearch) -> None:
        boxes = f"{counted(search.boxes, 'box', 'boxes')}, {len(search.waiting)} open"
        task.report(f"lowest energy: gap {search.open_gap:.1e}, {boxes}")
        if not search.proven:
            task.keep(lambda: _left_of_lowest(search))

    search.run(task.stop, tell)
    return _proof(task, search)


def _refined(task: Task, refined: Refined) -> LowestSearch:
    """The search with polylines as near to curved laws as the gap needs, begun where a coarse search has ended."""
    n = task.problem.size
    first = LowestSearch(problem=task.problem, gap=LIMITS.enough, cut=task.stop)
    first.start()
    first.run(task.stop, lambda _: task.report(f"first search: gap {first.open_gap:.1e}"))
    size = max(abs(first.upper), 1e-6 * task.problem.energy_size(first.x))
    problem = refined(LIMITS.error_share * task.gap * size, np.max(np.abs(first.region), axis=0)[:n])
    # what the polylines differ on both sides, and some more
    left = task.gap - 2.0 * (1.0 + LIMITS.error_share) * problem.error / size
    search = LowestSearch(problem=problem, gap=max(left, LIMITS.error_share * task.gap), cut=task.stop)
    if task.saved is None:
        search.start([first.x], first.region)
    return search


def _proof(task: Task, search: LowestSearch) -> Found:
    """What a search for the lowest energy knows; curved laws are worse by what their polylines may differ."""
    problem = search.problem
    kind = Kind.UNDECIDED if len(problem.lengths) else stationarity.kind(problem, search.x)
    point = StationaryPoint(x=search.x, energy=search.upper + problem.error, kind=kind)
    if (exact := None if task.exact is None else task.exact(search.x)) is not None:
        near = abs(exact.energy - search.upper) <= LIMITS.zero * problem.energy_size(search.x)
        point = exact if near and not problem.error else replace(point, kind=exact.kind)
    lower = search.lower - problem.error
    open_gap = max(point.energy - lower, 0.0) / (abs(point.energy) or 1.0)
    proven = search.proven and 2.0 * problem.error <= (task.gap - search.gap) * abs(search.upper)
    reason = f"a gap of {open_gap:.1e} is left: the curved laws are known no better than this"
    if not search.proven:
        reason = f"a gap of {open_gap:.1e} is open in {counted(len(search.waiting), 'box', 'boxes')}"
    return Found(
        points=(point,),
        lower_bound=lower,
        proven=proven,
        nodes=search.boxes,
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


PROGRAMMES: list[list[float]] = [[k / 8 for k in range(1, 9)], [2, 1.5, 1], [4, 2, 1], [-1, 0, 1]]
"""Load factors, one after the other; each programme begins at rest."""
MULTIPLES = (0, 0.5, 2, 5, 20)
"""They multiply the state that the first programme leads to."""


def loaded_states(problem: ScalarProblem, stop: Callable[[], bool]) -> Iterator[Array]:
    """States that no convex step makes lower: at the end of programmes of loads, and below multiples of the first.

    Args:
        problem: the problem.
        stop: asked before each, and inside long descents.
    """
    for start in _starts(problem, stop):
        if stop():
            return
        if not problem.is_far(x := _descended(problem, start, stop)):
            yield x


def _starts(problem: ScalarProblem, stop: Callable[[], bool]) -> Iterator[Array]:
    first = _loaded(problem, PROGRAMMES[0], stop)
    yield first
    yield from (_loaded(problem, programme, stop) for programme in PROGRAMMES[1:])
    yield from (factor * first for factor in MULTIPLES)


def _loaded(problem: ScalarProblem, programme: Sequence[float], stop: Callable[[], bool]) -> Array:
    """The state that a programme of loads leads to from rest."""
    x: Array = np.zeros(problem.size)
    for factor in programme:
        x = _descended(problem.under(factor * problem.force), x, stop)
    return x


def _descended(problem: ScalarProblem, x: Array, stop: Callable[[], bool]) -> Array:
    n, (low, high) = problem.size, problem.with_lengths(*problem.ends)
    return descend(problem, low, high, np.clip(x, low[:n], high[:n]), cut=stop)[0]
