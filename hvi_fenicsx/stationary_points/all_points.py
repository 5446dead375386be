"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where the laws do not drop inside
and S with the laws' least slopes is positive definite: then it has at most one stationary point. A drop is divided in
three: before it, behind it, and on it, where the traction may have any value between.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import LinAlgError, cholesky
from scipy.optimize import linprog

from ..typing import Array, Integers
from . import monotone_radius, stationarity
from .arcs import on_interval
from .boxes import Box, fresh_box
from .convex_programme import Chains, minimise
from .linear_test import LinearTest
from .relaxation import Relaxation, envelopes
from .rigid_balance import RigidBalance
from .scalar_problem import ScalarProblem
from .stationarity import Kind
from .tightening import ForceIntervals

SAME = 1e-7
"""Points nearer than this share of the displacements are one."""
MOST_ROUNDS = 6
"""How often a cell is tightened before it is divided."""
SHORTER = 0.9
"""Tightening goes on while some interval shrinks to this share."""
REGULAR = 1e-6
"""Least pivot, relative to the largest, of a matrix that counts as positive definite."""
WIDE = 30.0
"""Intervals that are wider, in displacements at which laws have joints, are made smaller by linear programmes."""
HALF = 0.5
"""Where these leave less than this share of an interval, the cell is looked at again before it is divided."""
CONDITION = 1e12
"""Condition number beyond which a linear system is singular."""


@dataclass(frozen=True, kw_only=True)
class StationaryPoint:
    """A point that satisfies the inequality.

    Attributes:
        x: (n,).
        energy: there.
        kind: minimiser, saddle or undecided.
        isolated: False where it is one of a continuum.
    """

    x: Array
    energy: float
    kind: Kind
    isolated: bool


@dataclass(kw_only=True)
class Enumeration:
    """A search for all stationary points.

    Attributes:
        problem: the problem.
        points: found so far.
        cells: looked at so far.
        waiting: a stack of cells not yet decided.
        undecided: cells in which the polylines of curved laws may have a point; whether the laws have, is not known.
    """

    problem: ScalarProblem
    points: list[StationaryPoint] = field(default_factory=list)
    cells: int = 0
    waiting: list[Box] = field(default_factory=list)
    undecided: int = 0

    def __post_init__(self) -> None:
        self._forces = ForceIntervals(self.problem, joints_at_ends=False)
        self._balance = RigidBalance(self.problem)
        self._curved = bool(np.any(self.problem.force_error))
        self._places: Array = np.empty((0, self.problem.size))
        self._linear, self._relaxation = LinearTest(self.problem), Relaxation(self.problem)

    def start(self) -> None:
        """Begin with a cell that is far larger than the problem's displacements."""
        problem, far = self.problem, self.problem.far
        low, high = np.maximum(problem.lower, -far), np.minimum(problem.upper, far)
        cell = self._tightened(fresh_box(low, high, np.zeros(problem.size)))
        if cell is None:
            return
        self.waiting.append(cell)

    def run(self, stop: Callable[[], bool], report: Callable[[Enumeration], None]) -> bool:
        """Divide cells until none is left; whether that is so.

        Args:
            stop: asked before each cell.
            report: told after each cell.
        """
        while self.waiting:
            if stop():
                return False
            self.cells += 1
            cell = self._tightened(self.waiting.pop())
            if cell is not None and not self._is_done(cell):
                self._divide(cell)
            report(self)
        return True

    def _is_done(self, cell: Box) -> bool:
        """Whether nothing is left to be found in a cell, or nothing more can be known about it."""
        if self._curved:
            return self._linear.excludes(cell.low, cell.high) or self._is_undecided(cell)
        return self._decided(cell) or self._linear.excludes(cell.low, cell.high)

    def _divide(self, cell: Box) -> None:
        """Put parts of a cell on the stack; the cell itself, made smaller, if it reaches far behind all joints."""
        wide = np.flatnonzero(cell.high - cell.low > WIDE * self.problem.reach)
        far = np.intersect1d(wide, self._balance.pivots)
        if wide.size and not len(self._balance.pivots):
            smaller = _within(cell, *self._linear.narrowed(cell.low, cell.high, wide))
            if np.any(smaller.low > smaller.high):
                return
            if np.any(smaller.high - smaller.low < HALF * (cell.high - cell.low)):
                self.waiting.append(smaller)
                return
            cell = smaller
        parts = list(self._far_parts(cell, int(far[0])) if far.size else self._parts(cell))
        self.waiting += (replace(part, share=cell.share / len(parts)) for part in parts)

    def _tightened(self, cell: Box) -> Box | None:
        """The cell made smaller; None if no stationary point is in it."""
        for _ in range(MOST_ROUNDS):
            sides = self._forces.tightened(cell.low, cell.high)
            sides = None if sides is None else self._balance.tightened(*sides)
            if sides is None:
                return None
            smaller = monotone_radius.tightened(self._relaxation, replace(cell, low=sides[0], high=sides[1]))
            if np.any(smaller.low > smaller.high):
                return None
            shrinks = np.any(smaller.high - smaller.low < SHORTER * (cell.high - cell.low))
            cell = smaller
            if not shrinks:
                break
        return cell

    def _decided(self, cell: Box) -> bool:
        """Whether the cell's points, one at most or a continuum, have been found."""
        fixed = cell.low == cell.high
        free = np.flatnonzero(~fixed)
        arcs, problem = self.problem.arcs, self.problem
        if not free.size:
            self.enter(cell.low)
            return True
        if np.any(arcs.drops(cell.low, cell.high) > 0.0):
            return False
        slopes = arcs.least_slope(cell.low, cell.high)
        matrix = problem.stiffness[np.ix_(free, free)] + np.diag(slopes[free])
        if _positive(matrix):
            self.enter(self._minimum(cell, np.where(fixed, 0.0, -np.minimum(slopes, 0.0))))
            return True
        if np.any(arcs.meets(cell.low, cell.high)[free].sum(axis=1) > 1) or np.any(self._at_bound(cell)[free]):
            return False
        self._enter_linear(cell, free, matrix)
        return True

    def _is_undecided(self, cell: Box) -> bool:
        """Whether a cell of curved laws can hardly be excluded: the polylines may have one point there."""
        arcs, free = self.problem.arcs, np.flatnonzero(cell.low < cell.high)
        if np.any(self._at_bound(cell)[free]):
            return False
        slopes = arcs.least_slope(cell.low, cell.high)[free]
        one = not free.size or bool(np.all(arcs.meets(cell.low, cell.high)[free].sum(axis=1) <= 1))
        if one or _positive(self.problem.stiffness[np.ix_(free, free)] + np.diag(slopes)):
            self.undecided += 1
            return True
        return False

    def _minimum(self, cell: Box, added: Array) -> Array:
        """The minimiser of a cell on which the energy is convex, the falls of its laws being less than S."""
        chains = Chains.of(envelopes(self.problem, cell.low, cell.high, added))
        return minimise(self.problem.stiffness - np.diag(added), self.problem.force, chains, cell.x).x

    def _enter_linear(self, cell: Box, free: Integers, matrix: Array) -> None:
        """The solutions of a cell in which every law is on one arc."""
        problem, arcs, rows = self.problem, self.problem.arcs, np.arange(self.problem.size)
        k = np.argmax(arcs.meets(cell.low, cell.high), axis=1)
        offset = arcs.tractions[rows, k] - arcs.slopes[rows, k] * arcs.anchors[rows, k]
        held = np.setdiff1d(rows, free)
        right = problem.force[free] - offset[free] - problem.stiffness[np.ix_(free, held)] @ cell.low[held]
        x, low, high = cell.low.copy(), cell.low[free], cell.high[free]
        if np.linalg.cond(matrix) < CONDITION:
            x[free] = np.linalg.solve(matrix, right)
            near = SAME * (1.0 + np.abs(x[free]))
            if np.all((x[free] >= low - near) & (x[free] <= high + near)):
                self.enter(x)
            return
        if (inner := _some_solution(matrix, right, np.column_stack([low, high]))) is not None:
            x[free] = inner
            self.enter(x, isolated=False)

    def enter(self, x: Array, *, isolated: bool = True) -> None:
        """Keep a point if it is stationary and new.

        Args:
            x: the point, (n,).
            isolated: False where it is one of a continuum.
        """
        problem = self.problem
        x = np.clip(x, problem.lower, problem.upper)
        if stationarity.imbalance(problem, x) > stationarity.ACCURACY:
            return
        near = SAME * (1.0 + float(np.max(np.abs(x), initial=0.0)))
        count = len(self.points)
        if np.any(np.abs(self._places[:count] - x).max(axis=1, initial=0.0) < near):
            return
        if count == len(self._places):
            self._places = np.concatenate([self._places, np.empty((count + 1, problem.size))])
        self._places[count] = x
        kind = stationarity.kind(problem, x)
        self.points.append(StationaryPoint(x=x, energy=problem.energy(x), kind=kind, isolated=isolated))

    def _at_bound(self, cell: Box) -> Array:
        """Where a bound of the problem can push, and the unknown is free to leave it."""
        ends = (cell.low <= self.problem.lower) | (cell.high >= self.problem.upper)
        return np.asarray(ends & (cell.low < cell.high))

    def _far_parts(self, cell: Box, i: int) -> Iterator[Box]:
        """The parts of a cell that reaches far: near the joints, and far from them on either side."""
        begin, end = float(cell.low[i]), float(cell.high[i])
        near = max(self.problem.reach, begin, -end)
        at = math.sqrt(near * max(end, -begin))
        marks = [begin, *(mark for mark in (-at, at) if begin < mark < end), end]
        for first, last in itertools.pairwise(marks):
            yield _with(cell, i, first, last)

    def _parts(self, cell: Box) -> Iterator[Box]:
        """The parts of a cell: at a drop where there is one, else at a joint, a bound, or in the middle."""
        arcs = self.problem.arcs
        drops = arcs.drops(cell.low, cell.high)
        if drops.any():
            i = int(np.argmax(drops / np.maximum(np.diag(self.problem.stiffness), 1e-300)))
            return self._at_joint(cell, i, drops_only=True)
        joints = np.where(cell.low < cell.high, arcs.meets(cell.low, cell.high).sum(axis=1) - 1, -1)
        if joints.max() > 0:
            return self._at_joint(cell, int(np.argmax(joints)), drops_only=False)
        return self._off_bound(cell, int(np.argmax(self._at_bound(cell))))

    def _at_joint(self, cell: Box, i: int, *, drops_only: bool) -> Iterator[Box]:
        arcs = on_interval(self.problem.chains[i], float(cell.low[i]), float(cell.high[i]))
        joints = [(a.high, b.rate(b.low) - a.rate(a.high)) for a, b in itertools.pairwise(arcs)]
        rounding = float(self.problem.arcs.rounding[i])
        chosen = [(x, j) for x, j in joints if j < -rounding or not drops_only]
        at, jump = chosen[len(chosen) // 2]
        if abs(jump) > rounding:  # looked at last: a minimiser is on no drop
            yield _with(cell, i, at, at)
        yield _with(cell, i, cell.low[i], at)
        yield _with(cell, i, at, cell.high[i])

    def _off_bound(self, cell: Box, i: int) -> Iterator[Box]:
        lower = cell.low[i] <= self.problem.lower[i]
        at = cell.low[i] if lower else cell.high[i]
        inner = np.nextafter(at, np.inf if lower else -np.inf)
        yield _with(cell, i, inner, cell.high[i]) if lower else _with(cell, i, cell.low[i], inner)
        yield _with(cell, i, at, at)


def _with(cell: Box, i: int, begin: float, end: float) -> Box:
    low, high = cell.low.copy(), cell.high.copy()
    low[i], high[i] = begin, end
    return _within(cell, low, high)


def _within(cell: Box, low: Array, high: Array) -> Box:
    return replace(cell, low=low, high=high, x=np.clip(cell.x, low, high))


def _some_solution(matrix: Array, right: Array, sides: Array) -> Array | None:
    """A solution of a singular linear system within intervals (n, 2), halfway between two; None if there is none."""
    size, n = float(np.abs(matrix).max()) or 1.0, len(right)
    ends = [
        linprog(np.full(n, sign), A_eq=matrix / size, b_eq=right / size, bounds=sides, method="highs")
        for sign in (1.0, -1.0)
    ]
    return None if any(e.status != 0 for e in ends) else np.asarray(0.5 * (ends[0].x + ends[1].x))


def _positive(matrix: Array) -> bool:
    """Whether a matrix is positive definite, and not nearly singular."""
    try:
        pivots = np.diag(cholesky(matrix, lower=True))
    except LinAlgError:
        return False
    return bool(pivots.min() > REGULAR * pivots.max())
