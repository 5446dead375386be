"""All stationary points: cells that no point satisfies are given up, the others divided until each has one at most.

A cell gives each unknown an interval, or one joint of its law. It needs no division where the laws do not drop inside
and S with the laws' least slopes is positive definite: then it has at most one stationary point. A drop is divided in
three: before it, behind it, and on it, where the traction may have any value between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import LinAlgError, cholesky
from scipy.optimize import linprog

from ..typing import Array, Integers
from . import monotone_radius, stationarity
from .balance_test import BalanceTest, Look
from .boxes import Box, fresh_box
from .cell_parts import at_bounds, parts
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
MOST_LOOKS = 4
"""How often a cell is tested by the weighed balance before it is divided."""
SHORTER_LOOK = 0.7
"""It is tested again while some interval shrinks to this share."""
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
        self._weighed = BalanceTest(self._relaxation)

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
            look = self._looked(self.waiting.pop())
            if look is not None and not self._is_done(look.cell):
                self.waiting += parts(self.problem, self._balance.pivots, look.cell, look.guide)
            report(self)
        return True

    def _is_done(self, cell: Box) -> bool:
        """Whether nothing is left to be found in a cell, or nothing more can be known about it."""
        if self._curved:
            return self._linear.excludes(cell.low, cell.high) or self._is_undecided(cell)
        return self._decided(cell) or self._linear.excludes(cell.low, cell.high)

    def _looked(self, cell: Box) -> Look | None:
        """The cell made smaller, and where to divide it; None if no stationary point is in it."""
        look = None
        for _ in range(MOST_LOOKS):
            if (tight := self._tightened(cell)) is None or (look := self._weighed.look(tight)) is None:
                return None
            cell = look.cell
            if not np.any(cell.high - cell.low < SHORTER_LOOK * (tight.high - tight.low)):
                break
        return look

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
        if np.any(arcs.meets(cell.low, cell.high)[free].sum(axis=1) > 1) or np.any(at_bounds(problem, cell)[free]):
            return False
        self._enter_linear(cell, free, matrix)
        return True

    def _is_undecided(self, cell: Box) -> bool:
        """Whether a cell of curved laws can hardly be excluded: the polylines may have one point there."""
        arcs, free = self.problem.arcs, np.flatnonzero(cell.low < cell.high)
        if np.any(at_bounds(self.problem, cell)[free]):
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
