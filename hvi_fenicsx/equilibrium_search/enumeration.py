"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where its laws tell that it has one
stationary point at most, and which. A drop is divided in three: before it, behind it, and on
it, where the traction may have any value between. Laws act on one component each, and their tractions are polylines.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import LinAlgError, cholesky
from scipy.optimize import linprog

from ..typing import Array, Integers, Mask
from . import stationarity
from .balance_programme import left_of
from .convex_programme import envelopes, minimise
from .relaxation import Relaxation
from .rigid_balance import RigidBalance
from .scalar_problem import Box, ScalarProblem
from .stationarity import PointList, StationaryPoint
from .thresholds import LIMITS
from .weighed_balance import ForceIntervals, clipped_again, shorter


@dataclass(kw_only=True)
class Enumeration:
    """A search for all stationary points.

    Attributes:
        problem: the problem.
        cut: whether the test of a cell is to be cut short, since the search stops.
        points: found so far.
        cells: looked at so far.
        waiting: a stack of cells not yet decided.
    """

    problem: ScalarProblem
    cut: Callable[[], bool] = lambda: False
    points: PointList = field(init=False)
    cells: int = 0
    waiting: list[Box] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.points = PointList(LIMITS.same)
        self._balance, self._forces = RigidBalance(self.problem), ForceIntervals(self.problem)
        self._relaxation = Relaxation(self.problem)

    def start(self) -> None:
        """Begin with a cell that is far larger than the problem's displacements."""
        self.waiting.append(Box.around(*self.problem.ends, np.zeros(self.problem.size)))

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
            self._divide(self.waiting.pop())
            report(self)
        return True

    def enter(self, x: Array, *, isolated: bool = True) -> None:
        """Keep the stationary point at a place, if there is one and it is new.

        Args:
            x: the place, (n,).
            isolated: False where it is one of a continuum.
        """
        problem = self.problem
        x = np.clip(x, problem.lower, problem.upper)
        if stationarity.imbalance(problem, x) <= LIMITS.accuracy:
            kind = stationarity.kind(problem, x)
            self.points.add(StationaryPoint(x=x, energy=problem.energy(x), kind=kind, isolated=isolated))

    def _divide(self, cell: Box) -> None:
        """Test a cell, keep its point, and put the parts of what is left on the stack."""
        left = self._smaller(cell)
        if left is not None and not self._decided(left):
            self.waiting += _far(self.problem, self._balance.pivots, left) or _any(self.problem, left)

    def _smaller(self, cell: Box) -> Box | None:
        """The cell made smaller; None if no stationary point is in it."""
        for _ in range(LIMITS.most_rounds):
            if (tight := self._tightened(cell)) is None or (left := left_of(self._relaxation, tight, self.cut)) is None:
                return None
            gained = shorter(tight.low, tight.high, left.low, left.high).any()
            cell = left
            if self.cut() or not gained:
                break
        return cell

    def _tightened(self, cell: Box) -> Box | None:
        """The cell made smaller by balances of forces; None if no stationary point is in it."""
        ends = clipped_again(self._balanced, cell.low, cell.high)
        return None if ends is None else Box.around(*ends, cell.x)

    def _balanced(self, low: Array, high: Array) -> tuple[Array, Array] | None:
        ends = self._forces.tightened(low, high)
        return None if ends is None else self._balance.tightened(*ends)

    def _decided(self, cell: Box) -> bool:
        """Whether a cell has one stationary point at most, or one that stands for all; it is kept."""
        arcs, problem = self.problem.arcs, self.problem
        fixed = cell.low == cell.high
        free = np.flatnonzero(~fixed)
        if not free.size:
            self.enter(cell.low)
            return True
        if np.any(arcs.drops(cell.low, cell.high) > 0.0):
            return False
        slopes = arcs.least_slope(cell.low, cell.high)
        matrix = problem.stiffness[np.ix_(free, free)] + np.diag(slopes[free])
        if _positive(matrix):
            added = np.where(fixed, 0.0, -np.minimum(slopes, 0.0))  # the energy is convex: falls are less than S
            chains = envelopes(problem, cell.low, cell.high, added)
            self.enter(minimise(problem.stiffness - np.diag(added), problem.force, chains, cell.x).x)
            return True
        if np.any(arcs.meets(cell.low, cell.high)[free].sum(axis=1) > 1) or np.any(at_bounds(problem, cell)[free]):
            return False
        self._enter_linear(cell, free, matrix)
        return True

    def _enter_linear(self, cell: Box, free: Integers, matrix: Array) -> None:
        """Keep the solution of a cell in which every law is on one arc, or one of them."""
        problem, arcs, rows = self.problem, self.problem.arcs, np.arange(self.problem.size)
        k = np.argmax(arcs.meets(cell.low, cell.high), axis=1)
        offset = arcs.offsets[rows, k]
        held = np.setdiff1d(rows, free)
        right = problem.force[free] - offset[free] - problem.stiffness[np.ix_(free, held)] @ cell.low[held]
        x, low, high = cell.low.copy(), cell.low[free], cell.high[free]
        regular = bool(np.linalg.cond(matrix) < 1.0 / LIMITS.rounding)
        if regular:
            x[free] = np.linalg.solve(matrix, right)
            near = LIMITS.same * (1.0 + np.abs(x[free]))
            inside = bool(np.all((x[free] >= low - near) & (x[free] <= high + near)))
        elif inside := (some := some_solution(matrix, right, np.column_stack([low, high]))) is not None:
            x[free] = some
        if inside:
            self.enter(x, isolated=regular)


def _positive(matrix: Array) -> bool:
    """Whether a matrix is positive definite, its least pivot above a share of the largest."""
    try:
        pivots = np.diag(cholesky(matrix, lower=True))
    except LinAlgError:
        return False
    return bool(pivots.min() > LIMITS.regular * pivots.max())


def some_solution(matrix: Array, right: Array, sides: Array) -> Array | None:
    """A solution of a singular linear system, halfway between two; None if there is none.

    Args:
        matrix: of the system, (n, n).
        right: its right side, (n,).
        sides: intervals, (n, 2).
    """
    size, n = float(np.abs(matrix).max()) or 1.0, len(right)
    ends = [
        linprog(np.full(n, sign), A_eq=matrix / size, b_eq=right / size, bounds=sides, method="highs")
        for sign in (1.0, -1.0)
    ]
    return None if any(e.status != 0 for e in ends) else 0.5 * (ends[0].x + ends[1].x)


def at_bounds(problem: ScalarProblem, cell: Box) -> Mask:
    """Where a bound of the problem can push, and the unknown is free to leave it.

    Args:
        problem: the problem.
        cell: the cell.
    """
    ends = (cell.low <= problem.lower) | (cell.high >= problem.upper)
    return ends & (cell.low < cell.high)


def _far(problem: ScalarProblem, pivots: Integers, cell: Box) -> list[Box]:
    """Growing parts of the widest interval of a pivot that reaches far: near the joints, and far on either side."""
    begin, end = cell.low[pivots], cell.high[pivots]
    near = np.maximum(problem.joint, np.maximum(begin, -end))
    most = np.maximum(end, -begin)
    wide = np.flatnonzero(most > LIMITS.wide * near)
    if not wide.size:
        return []
    j = wide[np.argmax((end - begin)[wide])]
    at = math.sqrt(near[j] * most[j])
    marks = [float(begin[j]), *(mark for mark in (-at, at) if begin[j] < mark < end[j]), float(end[j])]
    return [_with(cell, int(pivots[j]), first, last) for first, last in itertools.pairwise(marks)]


def _any(problem: ScalarProblem, cell: Box) -> list[Box]:
    """Parts at a drop where there is one, else at a joint, else at a bound."""
    arcs = problem.arcs
    drops = arcs.drops(cell.low, cell.high)
    joints = np.where(cell.low < cell.high, arcs.meets(cell.low, cell.high).sum(axis=1) - 1, 0)
    if not joints.any():
        return list(off_bound(problem, cell, int(np.argmax(at_bounds(problem, cell)))))
    i = int(np.argmax(drops / np.maximum(np.diag(problem.stiffness), 1e-300) if drops.any() else joints))
    at, jump = _middle_joint(problem, cell, i, only_drops=bool(drops.any()))
    halves = [_with(cell, i, float(cell.low[i]), at), _with(cell, i, at, float(cell.high[i]))]
    # what is on a jump is looked at last: a minimiser is on no drop
    return [_with(cell, i, at, at), *halves] if abs(jump) > arcs.rounding[i] else halves


def _middle_joint(problem: ScalarProblem, cell: Box, i: int, *, only_drops: bool) -> tuple[float, float]:
    """The middle one of the joints of a law inside a cell, and the rise of its traction there."""
    arcs = problem.arcs
    at, rises = arcs.high[i, :-1], arcs.after[i, 1:] - arcs.before[i, :-1]
    chosen = (at > cell.low[i]) & (at < cell.high[i]) & (~np.bool_(only_drops) | (rises < -arcs.rounding[i]))
    k = np.flatnonzero(chosen)
    k = k[len(k) // 2]
    return float(at[k]), float(rises[k])


def off_bound(problem: ScalarProblem, cell: Box, i: int) -> Iterator[Box]:
    """Two parts: an unknown off its bound, and on it.

    Args:
        problem: the problem.
        cell: the cell, which reaches to a bound of the unknown.
        i: the unknown.
    """
    lower = cell.low[i] <= problem.lower[i]
    at = cell.low[i] if lower else cell.high[i]
    inner = np.nextafter(at, np.inf if lower else -np.inf)
    yield _with(cell, i, inner, cell.high[i]) if lower else _with(cell, i, cell.low[i], inner)
    yield _with(cell, i, at, at)


def _with(cell: Box, i: int, begin: float, end: float) -> Box:
    low, high = cell.low.copy(), cell.high.copy()
    low[i], high[i] = begin, end
    return replace(cell, low=low, high=high, x=np.clip(cell.x, low, high))
