"""Cells of problems with laws of lengths: intervals of the unknowns, of each length r, and of its traction's size g.

Where κ = g/r of all vectors is known, S + κ has one solution: the directions follow. So what is divided is r at the
joints of its law, then r itself, and g where r is on a drop; and what problems of one component each divide. To these,
in a cell, vectors are springs with an error (:mod:`.length_ranges`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..typing import Array
from .balance_test import Look
from .boxes import Box, fresh_box
from .cell_tests import CellTests
from .descent import descend
from .divided import Divided
from .length_clip import LengthClip, law_range
from .length_parts import length_parts
from .length_ranges import Ranges, meet
from .linear_points import is_singular
from .point_list import PointList, StationaryPoint
from .polyline_cells import PolylineCells
from .rigid_balance import RigidBalance
from .scalar_problem import ScalarProblem
from .settled import settled
from .smooth_proofs import image, is_only_one, is_positive
from .smooth_system import SmoothSystem


class LengthCells:
    """The cells of one problem.

    Args:
        problem: the problem, of polylines.
    """

    def __init__(self, problem: ScalarProblem) -> None:
        self._problem, self._limits = problem, problem.thresholds.cells
        self._clip, self._judge = LengthClip(problem), PolylineCells(problem)
        others = np.maximum(problem.stiffness, 0.0), np.minimum(problem.stiffness, 0.0)
        self._positive, self._negative = others
        self._whole = self._start()
        self._balance = RigidBalance(self._whole.as_springs())

    def first(self) -> Box | None:
        """A cell that is far larger than the problem's displacements; None if no stationary point is in it."""
        whole = self._whole
        low, high = (np.concatenate([whole.x[k], whole.r[k], whole.g[k]]) for k in (0, 1))
        return self.tightened(fresh_box(low, high, np.zeros(self._problem.size)))

    def divided(self, cell: Box, known: PointList, cut: Callable[[], bool]) -> Divided:
        """Test a cell, and divide what is left.

        Args:
            cell: the cell.
            known: points that were found before.
            cut: whether to be content with less of a proof.
        """
        look = self._looked(cell, cut)
        if look is None:
            return Divided()
        decided = self._decided(look.cell, known)
        if isinstance(decided, Divided):
            return decided
        ranges = Ranges.of(self._problem, decided)
        tests = self._tests(ranges)
        if tests.excludes(_of_components(ranges, decided)):
            return Divided()
        found = length_parts(ranges, decided, tests.pivots, look.guide)
        return Divided(parts=found) if found else Divided(undecided=[decided])

    def point(self, x: Array) -> StationaryPoint | None:
        """The stationary point at a place; None where there is none.

        Args:
            x: the place, (n,).
        """
        return self._judge.point(x)

    def joined(self, x: Array, y: Array) -> bool:
        """Whether two points are parts of one continuum; of such cells none is decided.

        Args:
            x: a stationary point, (n,).
            y: another one, (n,).
        """
        return False

    def _start(self) -> Ranges:
        problem, far = self._problem, self._problem.far
        x = np.stack([np.maximum(problem.lower, -far), np.minimum(problem.upper, far)])
        r = np.stack(problem.lengths.within(*x))
        ranges = Ranges(problem=problem, x=x, r=r, g=np.zeros_like(r))
        return replace(ranges, g=law_range(ranges, r))

    def _tests(self, ranges: Ranges) -> CellTests:
        return CellTests(ranges.as_springs(), balance=self._balance)

    def _looked(self, cell: Box, cut: Callable[[], bool]) -> Look | None:
        """The cell made smaller, and where to divide it; None if no stationary point is in it."""
        look, limits = None, self._limits
        for _ in range(limits.most_looks):
            if (tight := self.tightened(cell)) is None:
                return None
            ranges = Ranges.of(self._problem, tight)
            look = self._tests(ranges).weighed(_of_components(ranges, tight), cut)
            if look is None:
                return None
            cell = replace(ranges, x=np.stack([look.cell.low, look.cell.high])).cell(tight)
            look = replace(look, cell=cell)
            if cut() or not np.any(cell.high - cell.low < limits.shorter_look * (tight.high - tight.low)):
                break
        return look

    def tightened(self, cell: Box) -> Box | None:
        """The cell made smaller; None if no stationary point is in it.

        Args:
            cell: the cell.
        """
        for _ in range(self._limits.most_rounds):
            smaller = self._tightened_once(cell)
            if smaller is None:
                return None
            shrinks = np.any(smaller.high - smaller.low < self._limits.shorter * (cell.high - cell.low))
            cell = smaller
            if not shrinks:
                break
        return cell

    def _tightened_once(self, cell: Box) -> Box | None:
        if (ranges := self._clip.shorter(Ranges.of(self._problem, cell))) is None:
            return None
        tests = self._tests(ranges)
        box = tests.tightened_once(_of_components(ranges, cell))
        if box is None:
            return None
        box = settled(tests.problem, box)
        forces = tests.balance.forces(box.low, box.high)
        if forces is None:
            return None
        ranges = replace(ranges, x=np.stack([box.low, box.high]))
        left = self._clip.balanced(ranges, self._of_laws(ranges.x, np.stack(forces)))
        return None if left is None else left.cell(replace(cell, x=box.x))

    def _of_laws(self, x: Array, forces: Array) -> Array:
        """What laws bear in a cell, where laws and bounds bear some forces, (2, n)."""
        problem, (low, high) = self._problem, x
        pull = np.stack([self._positive @ low + self._negative @ high, self._positive @ high + self._negative @ low])
        sizes = np.abs(problem.force) + np.abs(problem.stiffness) @ np.maximum(np.abs(low), np.abs(high))
        wide = self._limits.widened * sizes
        both = meet(forces, np.stack([problem.force - pull[1] - wide, problem.force - pull[0] + wide]))
        return np.stack(
            [np.where(high >= problem.upper, -np.inf, both[0]), np.where(low <= problem.lower, np.inf, both[1])]
        )

    def _decided(self, cell: Box, known: PointList) -> Divided | Box:
        """What is known of a cell; what is left of it where this is not all."""
        ranges = Ranges.of(self._problem, cell)
        if self._is_straight(ranges):
            return self._straight(ranges, cell, known)
        if (system := SmoothSystem.of(self._problem, cell)) is not None:
            return self._smooth(system, cell)
        if self._has_one_at_most(ranges) and (point := self._point_in(ranges, cell, known)) is not None:
            return Divided(points=[point])
        return cell

    def _is_straight(self, ranges: Ranges) -> bool:
        """Whether in the cell all laws are of one component each."""
        lengths = self._problem.lengths
        free = lengths.there & (ranges.x[0] < ranges.x[1])[lengths.unknowns]
        errors = np.where(free, ranges.springs[2], 0.0)
        least, most = ranges.arc_secants
        constant = (least == most) | np.any(ranges.alone, axis=1) | ~np.any(free, axis=1)
        return bool(np.all(constant) and np.all(errors <= ranges.laws.rounding[:, None]))

    def _straight(self, ranges: Ranges, cell: Box, known: PointList) -> Divided | Box:
        """What is known of such a cell; of a continuum one point is told, if it has the cell's lengths."""
        springs, (low, high) = ranges.as_springs(), ranges.x
        verdict = PolylineCells(springs, self._problem).verdict(_of_components(ranges, cell), known)
        if verdict.left is not None:
            return cell
        free = np.flatnonzero(low < high)
        matrix = springs.stiffness[np.ix_(free, free)] + np.diag(springs.arcs.least_slope(low, high)[free])
        if verdict.points or not free.size or not is_singular(matrix, self._limits.condition):
            return Divided(points=verdict.points)
        return cell

    def _smooth(self, system: SmoothSystem, cell: Box) -> Divided | Box:
        """What is known of a cell in which all laws are smooth."""
        starts: Sequence[Array] = (system.start, system.from_point(cell.x))
        for start in starts:
            u = system.solution(start)
            if u is not None and is_only_one(system, u):
                point = self.point(system.x(u))
                return Divided() if point is None else Divided(points=[point])
        found = image(system)
        if found is None:
            return cell
        ends = meet(system.ends, found)
        return Divided() if np.any(ends[0] > ends[1]) else system.smaller(cell, ends)

    def _has_one_at_most(self, ranges: Ranges) -> bool:
        """Whether S plus the least slopes of laws is positive definite, and none drops (:mod:`.smooth_proofs`)."""
        problem, (low, high) = self._problem, ranges.x
        n, arcs, (short, far) = problem.size, problem.arcs, ranges.r
        ends = np.concatenate([low, short]), np.concatenate([high, far])
        if np.any(arcs.drops(*ends) > 0.0):
            return False
        slopes = arcs.least_slope(*ends)
        on_drop = (short == far) & (short > 0.0)
        least = np.where(on_drop, ranges.secants[0], np.minimum(slopes[n:], ranges.arc_secants[0]))
        each = np.where(problem.lengths.there, least[:, None], 0.0)
        open_side = problem.lengths.opens & (ranges.vectors[0, :, 0] < 0.0)
        each[open_side, 0] = np.minimum(each[open_side, 0], 0.0)
        total = slopes[:n].copy()
        total[problem.lengths.members] += (each * problem.lengths.factors**2)[problem.lengths.there]
        free = np.flatnonzero(low < high)
        return is_positive(problem.stiffness[np.ix_(free, free)] + np.diag(total[free]), problem)

    def _point_in(self, ranges: Ranges, cell: Box, known: PointList) -> StationaryPoint | None:
        """A stationary point in a cell: one that is known, or that a descent finds; none at a drop of a law."""
        problem = self._problem
        for listed in known:
            if self._is_alone(ranges, listed.x):
                return listed
        ends = problem.with_lengths(*ranges.x)
        point = self.point(descend(problem, *ends, np.clip(cell.x, *ranges.x))[0])
        return point if point is not None and self._is_alone(ranges, point.x) else None

    def _is_alone(self, ranges: Ranges, x: Array) -> bool:
        """Whether a point is in a cell, and there is one at most in the cell and what is very near the point."""
        near = self._problem.thresholds.points.accuracy * (1.0 + float(np.max(np.abs(x), initial=0.0)))
        about = list[Array]()
        for ends, place in ((ranges.x, x), (ranges.r, self._problem.lengths.of(x))):
            if np.any((place < ends[0] - near) | (place > ends[1] + near)):
                return False
            wide = np.where(ends[0] < ends[1], near, 0.0)
            about.append(ends + np.array([[-1.0], [1.0]]) * wide)
        r = np.where(ranges.r <= near, ranges.r, about[1])  # none is below zero
        return self._has_one_at_most(replace(ranges, x=about[0], r=r))


def _of_components(ranges: Ranges, cell: Box) -> Box:
    """The cell of the unknowns alone."""
    box = fresh_box(ranges.x[0], ranges.x[1], cell.x)
    return replace(box, share=cell.share)
