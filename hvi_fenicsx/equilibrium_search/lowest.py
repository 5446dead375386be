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
from . import motions
from .arcs import ROUNDING, on_interval
from .boxes import Box, clipped, fresh_box
from .convex_programme import never
from .curvature import Curvature
from .level_set import Cut, level_set
from .relaxation import Relaxation
from .scalar_problem import ScalarProblem
from .systematic import descend
from .tightening import ForceIntervals

OpenBox = tuple[Array, Array, Array, float]
"""Low and high of a box, with those of rigid motions' shares, weights, and a bound of the laws' own energy in it."""


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
        cut: whether what is begun is to be cut short, since the search stops.
        x: the lowest point found.
        upper: its energy.
        boxes: bounded so far.
        waiting: a heap of open boxes by their bounds.
    """

    problem: ScalarProblem
    gap: float = 1e-8
    cut: Callable[[], bool] = never
    x: Array = field(init=False)
    upper: float = math.inf
    boxes: int = 0
    waiting: list[tuple[float, int, Box]] = field(default_factory=list)
    _numbers: Iterator[int] = field(default_factory=count)

    def __post_init__(self) -> None:
        self._thresholds = self.problem.thresholds.lowest
        self._relaxation = Relaxation(self.problem, self.cut)
        self._forces = ForceIntervals(self.problem)
        self._in_vain = self._next_descent = 0

    def start(self, points: Iterable[Array] = (), region: tuple[Array, Array] | None = None) -> None:
        """Bound the whole problem, or a box of it.

        Args:
            points: known points of low energy, each (n,).
            region: the ends of a box that is known to hold all lower points, (n + m,) each; None: none is known.

        Raises:
            SolverError: the energy is not bounded from below, or this cannot be shown.
            Cut: the search stops before this is known.
        """
        problem, far = self.problem, self.problem.far
        whole = problem.with_lengths(np.maximum(problem.lower, -far), np.minimum(problem.upper, far))
        self._low, self._high = whole if region is None else region
        self.x = self._inside(np.zeros(problem.size))
        for x in (self.x, *points):
            self._try(self._inside(x))
        first, curvature = self._first_relaxation()
        if region is None and self._far(first.x):
            raise SolverError("no lowest energy: it falls without limit, or only a limit far away was found")
        self._enter_level_set(first, curvature)

    def _first_relaxation(self) -> tuple[Box, Curvature]:
        """The relaxation on the region."""
        first = self._relaxation.solve(fresh_box(self._low, self._high, self.x), self._thresholds.parts[0])
        if self.cut():
            raise Cut
        return first

    def _enter_level_set(self, first: Box, curvature: Curvature) -> None:
        """Enter what a relaxation leaves of its box."""
        self._try(first.x)
        level = self.upper + 2.0 * self.problem.error
        low, high = level_set(self.problem, first, curvature, level, self.cut)
        self._low, self._high = low, high
        self._enter(self._moving(replace(fresh_box(low, high, first.x), bound=first.bound)))

    def _moving(self, box: Box) -> Box:
        """The box with the intervals of rigid motions' shares."""
        low, high = self._relaxation.share_span(box.low, box.high)
        return replace(box, motion_low=low, motion_high=high)

    def resume(self, boxes: Iterable[OpenBox], point: Array) -> None:
        """Go on from open boxes and the lowest point.

        Args:
            boxes: from :meth:`open_boxes`.
            point: the lowest point found, (n,).
        """
        self.x, self.upper = point, self.problem.energy(point)
        listed = list(boxes)
        size = len(self.problem.chains)
        self._low = np.min([b[0][:size] for b in listed], axis=0, initial=np.inf)
        self._high = np.max([b[1][:size] for b in listed], axis=0, initial=-np.inf)
        self._try(point)
        for low, high, weights, bound in listed:
            box = replace(fresh_box(low[:size], high[:size], point), weights=weights, share=1.0 / len(listed))
            box = replace(box, bound=bound - self.problem.error)
            with_shares = replace(box, motion_low=low[size:], motion_high=high[size:])
            self._enter(with_shares if len(low) > size else self._moving(box))

    @property
    def region(self) -> tuple[Array, Array]:
        """The ends of a box with all points that are lower than the lowest found, also of the laws themselves."""
        return self._low, self._high

    def open_boxes(self) -> Iterator[OpenBox]:
        """The boxes that wait."""
        for _, _, box in self.waiting:
            low, high = ((box.low, box.motion_low), (box.high, box.motion_high))
            yield np.concatenate(low), np.concatenate(high), box.weights, box.bound - self.problem.error

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
        return max(self._thresholds.share_used * self.gap * self._size, ROUNDING * self._parts)

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
            for half in halves(self._relaxation, box):
                self._enter(replace(half, share=0.5 * box.share))
            report(self.progress())
        return True

    def _enter(self, box: Box) -> None:
        """Tighten and bound a box; it waits if it is still open."""
        self.boxes += 1
        found = self._bounded(box)
        if found is None:
            return
        if found.tight:  # every envelope is tight: the point is the box's lowest, to rounding
            self._try(found.x)
            if found.bound >= self.upper - self._allowed:
                return
            found = replace(found, gaps=found.high - found.low)
        heapq.heappush(self.waiting, (found.bound, next(self._numbers), found))

    def _bounded(self, box: Box) -> Box | None:
        for round_ in range(self.problem.thresholds.cells.most_rounds):
            before = box.bound
            for part in self._thresholds.parts:
                if self.cut():
                    return box
                smaller = self._forces.tightened(box.low, box.high)
                if smaller is None:
                    return None
                box = replace(box, low=smaller[0], high=smaller[1], x=clipped(box.x, *smaller))
                lost = self._thresholds.lost * (self.upper - box.bound) if math.isfinite(box.bound) else 0.0
                box, curvature = self._relaxation.solve(box, part, lost)
                if self._closed(box):
                    return None
                if part == self._thresholds.parts[-1] and round_ == 0:
                    self._try_at_times(box.x)
                    if self._closed(box):
                        return None
                reach = curvature.radii * self._radius(box)
                at = self.problem.arguments(box.x)
                box = replace(box, low=np.maximum(box.low, at - reach), high=np.minimum(box.high, at + reach))
                box = self._motions_tightened(box, curvature)
                if np.any(box.motion_low > box.motion_high) or np.any(box.low > box.high):
                    return None
            if box.tight or box.bound - before < self._thresholds.worthwhile * (self.upper - box.bound):
                break
        return box

    def _motions_tightened(self, box: Box, curvature: Curvature) -> Box:
        """The intervals of rigid motions' shares made smaller by those of the unknowns, and by strong convexity."""
        low, high = self._relaxation.share_span(box.low, box.high)
        at = self._relaxation.shares(box.x)
        reach, apart = (r * self._radius(box) for r in (curvature.share_radii, curvature.apart))
        low = np.maximum(box.motion_low, np.maximum(low, at - reach))
        high = np.minimum(box.motion_high, np.minimum(high, at + reach))
        up, down = np.maximum(curvature.follow, 0.0), np.minimum(curvature.follow, 0.0)
        n = len(box.x)
        first, last = box.low.copy(), box.high.copy()
        first[:n] = np.maximum(first[:n], box.x + up @ (low - at) + down @ (high - at) - apart)
        last[:n] = np.minimum(last[:n], box.x + up @ (high - at) + down @ (low - at) + apart)
        return replace(box, low=first, high=last, motion_low=low, motion_high=high)

    def _radius(self, box: Box) -> float:
        """How far lower points are from the relaxation's minimiser, in the norm of its matrix."""
        return math.sqrt(2.0 * max(self.upper - box.value, 0.0)) * (1.0 + self.problem.thresholds.cells.widened_radius)

    def _closed(self, box: Box) -> bool:
        return box.bound >= self.upper - self._allowed

    def _try_at_times(self, x: Array) -> None:
        """Descend from a point, the more seldom the more often in a row nothing lower was found."""
        if self.boxes < self._next_descent:
            return
        before = self.upper
        self._try(x)
        self._in_vain = 0 if self.upper < before else min(self._in_vain + 1, self._thresholds.most_skipped)
        self._next_descent = self.boxes + self._in_vain

    def _try(self, x: Array) -> None:
        """Descend from a point."""
        found, energy = descend(self.problem, self._low, self._high, x, self.upper, self.cut)
        if energy < self.upper:
            self.x, self.upper = found, energy

    def _far(self, x: Array) -> bool:
        """Whether a point touches the first box where there is no bound."""
        problem, n = self.problem, self.problem.size
        below, above = x <= self._low[:n], x >= self._high[:n]
        return bool(np.any(below & np.isneginf(problem.lower) | above & np.isposinf(problem.upper)))

    def _inside(self, x: Array) -> Array:
        return clipped(x, self._low, self._high)


def halves(relaxation: Relaxation, box: Box) -> list[Box]:
    """Two boxes: where the envelope and the law differ most, at the joint in the chord that is nearest to x.

    Args:
        relaxation: of the problem.
        box: the box, with the gaps of its relaxation.
    """
    if box.motion_gaps.max(initial=0.0) > box.gaps.max():
        return _halves_of_motion(relaxation, box)
    i = int(np.argmax(box.gaps))
    at = float(relaxation.problem.arguments(box.x)[i])
    chain = relaxation.problem.chains[i]
    ends = (a.high for a in on_interval(chain, float(box.low[i]), float(box.high[i]))[:-1])
    inside = [e for e in ends if box.chord_low[i] < e < box.chord_high[i]]
    if inside:
        at = min(inside, key=lambda e: abs(e - at))
    left, right = box.high.copy(), box.low.copy()
    left[i] = right[i] = at
    return [replace(box, high=left), replace(box, low=right)]


def _halves_of_motion(relaxation: Relaxation, box: Box) -> list[Box]:
    """Two boxes: parts of the interval of a rigid motion's share."""
    j = int(np.argmax(box.motion_gaps))
    left, right = box.motion_high.copy(), box.motion_low.copy()
    here, joint = float(relaxation.shares(box.x)[j]), float(relaxation.joints[j])
    limits = relaxation.problem.thresholds.bounds
    left[j] = right[j] = motions.divided(float(right[j]), float(left[j]), joint, here, limits)
    return [replace(box, motion_high=left), replace(box, motion_low=right)]
