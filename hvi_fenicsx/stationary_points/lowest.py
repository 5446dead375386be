"""The lowest energy with a proof: branch and bound over intervals of the unknowns and lengths with laws.

Of the open boxes the one with the lowest bound is divided, until no open box can hold a point below the lowest
energy found by more than the gap that is allowed. A box is made smaller first, in turn: what the balance of forces
leaves of it, and what strong convexity of its relaxation leaves of it below the lowest energy found.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from itertools import count

import numpy as np

from ..errors import SolverError
from ..typing import Array
from .arcs import on_interval
from .descent import descend
from .level_set import level_set
from .relaxation import Box, Relaxation
from .scalar_problem import ScalarProblem
from .tightening import ForceIntervals

PARTS = (0.9, 0.999)
"""Shares of the largest curvature, in turn: the first leaves convexity to tighten with, the second bounds best."""
MOST_ROUNDS = 6
"""How often a box is tightened and bounded before it is divided."""
WORTHWHILE = 0.15
"""A round that closes less than this share of a box's gap is the last."""
MOST_SKIPPED = 10
"""Boxes from which no descent is made, between two from which one is."""
ROUNDING = 1e-13
"""Energies that differ by less than this share of their parts are equal."""


@dataclass(frozen=True, kw_only=True)
class Progress:
    """How far a search has come.

    Attributes:
        lower: no point has a lower energy.
        upper: the lowest energy found.
        gap: their difference, relative to the energy.
        boxes: bounded so far.
        waiting: not yet decided.
        share: what these are of the whole search.
    """

    lower: float
    upper: float
    gap: float
    boxes: int
    waiting: int
    share: float


@dataclass(kw_only=True)
class LowestSearch:
    """A search for the lowest energy.

    Attributes:
        problem: the problem.
        gap: relative gap that is allowed.
        x: the lowest point found.
        upper: its energy.
        boxes: bounded so far.
        waiting: a heap of open boxes by their bounds.
    """

    problem: ScalarProblem
    gap: float = 1e-8
    x: Array = field(init=False)
    upper: float = math.inf
    boxes: int = 0
    waiting: list[tuple[float, int, Box]] = field(default_factory=list)
    _numbers: Iterator[int] = field(default_factory=count)

    def __post_init__(self) -> None:
        self._relaxation = Relaxation(self.problem)
        self._forces = ForceIntervals(self.problem)
        self._in_vain = self._next_descent = 0

    def start(self, points: Iterable[Array] = ()) -> None:
        """Bound the whole problem.

        Args:
            points: known points of low energy, each (n,).

        Raises:
            SolverError: the energy is not bounded from below, or this cannot be shown.
        """
        problem = self.problem
        far = problem.far
        low, high = problem.with_lengths(np.maximum(problem.lower, -far), np.minimum(problem.upper, far))
        self._low, self._high = low, high
        self.x = self._inside(np.zeros(problem.size))
        for x in (self.x, *points):
            self._try(self._inside(x))
        box = fresh_box(low, high, self.x)
        first, curvature = self._relaxation.solve(box, PARTS[0])
        if self._far(first.x):
            raise SolverError("no lowest energy: it falls without limit, or only a limit far away was found")
        self._try(first.x)
        low, high = level_set(problem, first, curvature, self.upper + 2.0 * problem.error)
        self._low, self._high = low, high
        self._enter(fresh_box(low, high, first.x))

    def resume(self, boxes: Iterable[tuple[Array, Array, Array]], point: Array) -> None:
        """Go on from open boxes, each low, high and weights, and the lowest point.

        Args:
            boxes: from :meth:`open_boxes`.
            point: the lowest point found, (n,).
        """
        self.x, self.upper = point, self.problem.energy(point)
        listed = list(boxes)
        self._low = np.min([b[0] for b in listed], axis=0, initial=np.inf)
        self._high = np.max([b[1] for b in listed], axis=0, initial=-np.inf)
        self._try(point)
        for low, high, weights in listed:
            self._enter(replace(fresh_box(low, high, point), weights=weights, share=1.0 / len(listed)))

    @property
    def region(self) -> tuple[Array, Array]:
        """The ends of a box with all points that are lower than the lowest found, also of the laws themselves."""
        return self._low, self._high

    def open_boxes(self) -> Iterator[tuple[Array, Array, Array]]:
        """Low, high and weights of the boxes that wait."""
        return ((box.low, box.high, box.weights) for _, _, box in self.waiting)

    def progress(self) -> Progress:
        """How far the search is."""
        lower = min(self.waiting[0][0], self.upper) if self.waiting else self.upper - self._allowed
        return Progress(
            lower=lower,
            upper=self.upper,
            gap=max(self.upper - lower, 0.0) / self._size,
            boxes=self.boxes,
            waiting=len(self.waiting),
            share=sum(box.share for _, _, box in self.waiting),
        )

    @property
    def proven(self) -> bool:
        """Whether no point is lower than the lowest found, but for the gap allowed."""
        return not self.waiting or self.waiting[0][0] >= self.upper - self._allowed

    @property
    def _size(self) -> float:
        return max(abs(self.upper), 1e-6 * self._parts, 1e-300)

    @property
    def _allowed(self) -> float:
        return max(self.gap * self._size, ROUNDING * self._parts)

    @property
    def _parts(self) -> float:
        """The sizes of the parts of the energy, at the lowest point or, where it is at rest, in the region."""
        n = self.problem.size
        reach = np.maximum(np.abs(self._low[:n]), np.abs(self._high[:n]))
        return self.problem.energy_size(self.x) or float(np.abs(self.problem.force) @ reach)

    def run(self, stop: Callable[[], bool], report: Callable[[Progress], None]) -> bool:
        """Divide boxes until the proof is there; whether it is.

        Args:
            stop: asked before each division.
            report: told after each division.
        """
        while not self.proven:
            if stop():
                return False
            _, _, box = heapq.heappop(self.waiting)
            for low, high in self._halves(box):
                half = replace(fresh_box(low, high, box.x), bound=box.bound, weights=box.weights)
                self._enter(replace(half, share=0.5 * box.share))
            report(self.progress())
        return True

    def _halves(self, box: Box) -> list[tuple[Array, Array]]:
        """Two boxes: where the envelope and the law differ most, at the joint in the chord that is nearest to x."""
        i = int(np.argmax(box.gaps))
        at = float(self.problem.arguments(box.x)[i])
        ends = (a.high for a in on_interval(self.problem.chains[i], float(box.low[i]), float(box.high[i]))[:-1])
        inside = [e for e in ends if box.chord_low[i] < e < box.chord_high[i]]
        if inside:
            at = min(inside, key=lambda e: abs(e - at))
        left, right = box.high.copy(), box.low.copy()
        left[i] = right[i] = at
        return [(box.low, left), (right, box.high)]

    def _enter(self, box: Box) -> None:
        """Tighten and bound a box; it waits if it is still open."""
        self.boxes += 1
        found = self._bounded(box)
        if found is None:
            return
        if not found.gaps.any():  # every envelope is tight: the point is the box's lowest, to rounding
            self._try(found.x)
            if found.bound >= self.upper - self._allowed:
                return
            found = replace(found, gaps=found.high - found.low)
        heapq.heappush(self.waiting, (found.bound, next(self._numbers), found))

    def _bounded(self, box: Box) -> Box | None:
        for round_ in range(MOST_ROUNDS):
            before = box.bound
            for part in PARTS:
                smaller = self._forces.tightened(box.low, box.high)
                if smaller is None:
                    return None
                box = replace(box, low=smaller[0], high=smaller[1], x=_clipped(box.x, *smaller))
                box, curvature = self._relaxation.solve(box, part)
                if self._closed(box):
                    return None
                if part == PARTS[-1] and round_ == 0:
                    self._try_at_times(box.x)
                    if self._closed(box):
                        return None
                reach = curvature.radii * math.sqrt(2.0 * max(self.upper - box.bound, 0.0))
                at = self.problem.arguments(box.x)
                box = replace(box, low=np.maximum(box.low, at - reach), high=np.minimum(box.high, at + reach))
            if not box.gaps.any() or box.bound - before < WORTHWHILE * (self.upper - box.bound):
                break
        return box

    def _closed(self, box: Box) -> bool:
        return box.bound >= self.upper - self._allowed

    def _try_at_times(self, x: Array) -> None:
        """Descend from a point, the more seldom the more often in a row nothing lower was found."""
        if self.boxes < self._next_descent:
            return
        before = self.upper
        self._try(x)
        self._in_vain = 0 if self.upper < before else min(self._in_vain + 1, MOST_SKIPPED)
        self._next_descent = self.boxes + self._in_vain

    def _try(self, x: Array) -> None:
        """Descend from a point."""
        found, energy = descend(self.problem, self._low, self._high, x, self.upper)
        if energy < self.upper:
            self.x, self.upper = found, energy

    def _far(self, x: Array) -> bool:
        """Whether a point touches the first box where there is no bound."""
        problem, n = self.problem, self.problem.size
        below, above = x <= self._low[:n], x >= self._high[:n]
        return bool(np.any(below & np.isneginf(problem.lower) | above & np.isposinf(problem.upper)))

    def _inside(self, x: Array) -> Array:
        return _clipped(x, self._low, self._high)


def fresh_box(low: Array, high: Array, x: Array) -> Box:
    """A box of which nothing is known.

    Args:
        low: (n + m,).
        high: (n + m,).
        x: where its relaxation is to begin, (n,).
    """
    none = np.zeros(len(low))
    return Box(
        low=low,
        high=high,
        bound=-math.inf,
        x=_clipped(x, low, high),
        weights=none,
        gaps=none,
        chord_low=low,
        chord_high=high,
    )


def _clipped(x: Array, low: Array, high: Array) -> Array:
    """The unknowns within their intervals, (n,)."""
    return np.asarray(np.clip(x, low[: len(x)], high[: len(x)]))
