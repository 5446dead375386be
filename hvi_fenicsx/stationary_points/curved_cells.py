"""Cells of curved laws: a cell is done if it holds one stationary point at most, and that one is known.

That there is one at most follows from the ranges of the laws' slopes (:mod:`.regular_slopes`). The point is found by
Newton's method on the laws; the cell is done if together with the point, which may be a little beside it, it still
has one at most. Where no law jumps and no bound bears, Krawczyk's operator makes the cell smaller, or tells that it has
no point (Krawczyk 1969, Computing 4).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..typing import Array, Integers
from .balance_programme import Guide
from .boxes import Box, clipped, fresh_box
from .cell_parts import at_bounds
from .cell_verdict import Verdict
from .curved_laws import CurvedLaws
from .linear_points import is_singular, some_solution
from .point_list import PointList, StationaryPoint
from .regular_slopes import is_regular

EPSILON = float(np.finfo(float).eps)


class CurvedCells:
    """Cells of curved laws.

    Args:
        laws: the laws, with bounds of their slopes.
    """

    def __init__(self, laws: CurvedLaws) -> None:
        self._laws, self._near, self._thresholds = laws, laws.near, laws.near.thresholds.cells

    def point(self, x: Array) -> StationaryPoint | None:
        """The stationary point near one of the polylines; None where there is none.

        Args:
            x: displacements, (n,).
        """
        return self._laws.point(x)

    def verdict(self, cell: Box, known: PointList) -> Verdict:
        """What is known of a cell.

        Args:
            cell: the cell.
            known: points that were found before.
        """
        if np.array_equal(cell.low, cell.high):
            return Verdict(points=[point for point in [self._laws.point(cell.low)] if point is not None])
        smaller = self._smaller(cell)
        if smaller is None:
            return Verdict()
        if not self._is_regular(smaller.low, smaller.high):
            return self._singular(smaller)
        if self._nearest_is_alone(smaller, known):
            return Verdict()
        for start in (0.5 * (smaller.low + smaller.high), smaller.x):
            point = self._laws.point(start)
            if point is not None and self._is_alone(smaller, point.x):
                return Verdict(points=[point])
        return self._left(smaller)

    def joined(self, x: Array, y: Array) -> bool:
        """Whether two points cannot be told apart, or are parts of one continuum: all between is in balance.

        Args:
            x: a stationary point, (n,).
            y: another one, (n,).
        """
        return all(self._laws.is_balanced(x + share * (y - x)) for share in self._thresholds.shares)

    def _singular(self, cell: Box) -> Verdict:
        """What is known of a cell that may have several points."""
        free = np.flatnonzero(cell.low < cell.high)
        least, most = (ends[free] for ends in self._laws.slopes(cell.low, cell.high))
        # a jump, or a bound that bears, has an infinite slope
        finite = bool(np.all(np.isfinite([least, most])))
        if finite and np.all(most - least <= self._thresholds.straight * np.maximum(np.abs(least), np.abs(most))):
            matrix = self._near.stiffness[np.ix_(free, free)] + np.diag(least)
            if is_singular(matrix, self._thresholds.condition):
                return self._straight(cell, free, matrix)
        return Verdict(undecided=True, points=points) if (points := self._degenerate(cell)) else self._left(cell)

    def _straight(self, cell: Box, free: Integers, matrix: Array) -> Verdict:
        """The continuum of a cell in which all tractions are straight, and S with their slopes is singular."""
        middle = 0.5 * (cell.low + cell.high)
        right = matrix @ middle[free] + self._rest(middle)[0][free]
        inner = some_solution(matrix, right, np.column_stack([cell.low, cell.high])[free])
        if inner is None:
            return Verdict()
        middle[free] = inner
        point = self._laws.point(middle)
        return Verdict() if point is None else Verdict(points=[replace(point, isolated=False)])

    def _degenerate(self, cell: Box) -> list[StationaryPoint]:
        """A point in a small cell at which S plus slopes is next to singular, if dividing the cell tells no more."""
        wide = float(np.max(cell.high - cell.low))
        size = 1.0 + float(np.max(np.abs([cell.low, cell.high])))
        if wide > self._thresholds.small * size or (point := self._laws.point(0.5 * (cell.low + cell.high))) is None:
            return []
        near = np.all((point.x >= cell.low - wide) & (point.x <= cell.high + wide))
        if not near or (way := self._laws.soft_direction(point.x)) is None:
            return []
        row = any(self._laws.is_balanced(point.x + step * way) for step in (wide, -wide))
        if row:
            return [replace(point, isolated=False)]
        return [point] if wide <= self._thresholds.tiny * size else []

    def _left(self, cell: Box) -> Verdict:
        guide = self._guide(cell)
        size = 1.0 + np.max(np.abs([cell.low, cell.high]))
        small = np.max(cell.high - cell.low) <= self._thresholds.smallest * size
        small = bool(small and np.all(np.isfinite(guide.law + guide.bound))) or self._is_unknown(cell)
        return Verdict(left=None if small else cell, guide=guide, undecided=small)

    def _guide(self, cell: Box) -> Guide:
        """Where the slopes' ranges leave most of the forces open, at a jump or in the middle."""
        least, most = self._laws.slopes(cell.low, cell.high)
        wide, jumps = cell.high - cell.low, self._jumps(cell)
        bears = (wide > 0.0) & at_bounds(self._near, cell)
        slopes = np.where(np.isfinite(least) & np.isfinite(most), most - least, 0.0)
        return Guide(
            x=np.where(np.isfinite(jumps), jumps, 0.5 * (cell.low + cell.high)),
            law=np.where(np.isfinite(jumps), np.inf, slopes * wide**2),
            bound=np.where(bears, np.inf, 0.0),
        )

    def _jumps(self, cell: Box) -> Array:
        """The place inside of the largest jump of each traction; not a number where there is none, (n,)."""
        arcs = self._near.arcs
        inside = (arcs.high[:, :-1] > cell.low[:, None]) & (arcs.high[:, :-1] < cell.high[:, None])
        jumps = np.where(inside, np.abs(arcs.after[:, 1:] - arcs.before[:, :-1]), 0.0)
        at = arcs.high[np.arange(len(jumps)), np.argmax(jumps, axis=1)]
        return np.where(jumps.max(axis=1, initial=0.0) > arcs.rounding, at, np.nan)

    def _is_unknown(self, cell: Box) -> bool:
        """Whether no bound of the slopes is known, and the polylines are straight."""
        least, _ = self._laws.slopes(cell.low, cell.high)
        straight = self._near.arcs.meets(cell.low, cell.high).sum(axis=1) <= 1
        return bool(np.any(np.isinf(least) & straight & (cell.low < cell.high)))

    def _nearest_is_alone(self, cell: Box, known: PointList) -> bool:
        """Whether the cell has no point beside the nearest of those that are known."""
        if not len(known):
            return False
        return self._is_alone(cell, known.listed[int(np.argmin(known.distances(cell.x)))].x)

    def _is_alone(self, cell: Box, x: Array) -> bool:
        """Whether the cell, together with a stationary point, has no other."""
        close = self._near.thresholds.points.accuracy * (1.0 + float(np.max(np.abs(x), initial=0.0)))
        fixed = cell.low == cell.high
        wide = np.where(fixed & (np.abs(x - cell.low) <= close), 0.0, close)
        point, beside = np.where(wide > 0.0, x, cell.low), np.where(fixed, wide, 0.0)
        low, high = np.minimum(cell.low - beside, point - wide), np.maximum(cell.high + beside, point + wide)
        return self._is_regular(low, high) and self._exists(x, close)

    def _exists(self, x: Array, close: float) -> bool:
        """Whether a stationary point is this close to a computed one: Krawczyk's image of what is close lies within.

        Unknowns that a jump or a bound holds stay.
        """
        ends = self._laws.slopes(x - close, x + close)
        wide = np.where(np.all(np.isfinite(ends), axis=0), close, 0.0)
        ball = fresh_box(x - wide, x + wide, x)
        free = np.flatnonzero(wide)
        image = self._image(ball, free)
        return image is not None and bool(np.all((image[0] > ball.low[free]) & (image[1] < ball.high[free])))

    def _is_regular(self, low: Array, high: Array) -> bool:
        least, most = self._laws.slopes(low, high)
        free = np.flatnonzero(low < high)
        stiffness = self._near.stiffness[np.ix_(free, free)]
        return is_regular(stiffness, least[free], most[free], self._thresholds.least_width)

    def _smaller(self, cell: Box) -> Box | None:
        """What Krawczyk's operator leaves of a cell; None if it has no stationary point."""
        free = np.flatnonzero(cell.low < cell.high)
        for _ in range(self._thresholds.image_steps if free.size else 0):
            image = self._image(cell, free)
            if image is None:
                break
            low, high = cell.low.copy(), cell.high.copy()
            low[free], high[free] = np.maximum(low[free], image[0]), np.minimum(high[free], image[1])
            if np.any(low > high):
                return None
            # a side must not become a point: that would be a joint
            thin = (low == high) & (cell.low < cell.high)
            low, high = np.where(thin, cell.low, low), np.where(thin, cell.high, high)
            shrinks = np.any(high - low < self._thresholds.shorter_image * (cell.high - cell.low))
            cell = replace(cell, low=low, high=high, x=clipped(cell.x, low, high))
            if not shrinks:
                break
        return cell

    def _image(self, cell: Box, free: Integers) -> tuple[Array, Array] | None:
        """An interval for all stationary points of a cell, free unknowns only; None where laws jump or bounds bear."""
        least, most = (ends[free] for ends in self._laws.slopes(cell.low, cell.high))
        if not np.all(np.isfinite(least) & np.isfinite(most)):
            return None
        middle = 0.5 * (cell.low + cell.high)
        half = np.maximum(cell.high - middle, middle - cell.low)[free] * (1.0 + 4.0 * EPSILON)
        matrix = self._near.stiffness[np.ix_(free, free)] + np.diag(0.5 * (least + most))
        try:
            inverse = np.linalg.inv(matrix)
        except np.linalg.LinAlgError:
            return None
        rest, error = (part[free] for part in self._rest(middle))
        n = len(free)
        off = np.abs(np.eye(n) - inverse @ matrix) + 2.0 * n * EPSILON * (np.abs(inverse) @ np.abs(matrix))
        reach = np.abs(inverse) @ (error + 0.5 * (most - least) * (1.0 + 4.0 * EPSILON) * half) + off @ half
        moved = middle[free] + inverse @ rest
        reach += 4.0 * EPSILON * (np.abs(moved) + n * (np.abs(inverse) @ np.abs(rest)))
        return moved - reach, moved + reach

    def _rest(self, x: Array) -> tuple[Array, Array]:
        """What is missing in the balance where no law jumps, and its rounding error, (n,) each."""
        near = self._near
        tractions, sizes = self._laws.tractions(x)
        sizes = sizes + np.abs(near.force) + np.abs(near.stiffness) @ np.abs(x)
        return near.force - near.stiffness @ x - tractions, self._thresholds.roundings * len(x) * EPSILON * sizes
