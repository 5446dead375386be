"""The parts of a cell of which it is not known whether stationary points are in it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..typing import Integers, Mask
from .arcs import on_interval
from .balance_programme import Guide
from .boxes import Box
from .scalar_problem import ScalarProblem


def parts(problem: ScalarProblem, pivots: Integers, cell: Box, guide: Guide | None) -> list[Box]:
    """The parts of a cell, the one to look at first last; each has its share of the search.

    Args:
        problem: the problem.
        pivots: unknowns that fix the rigid motions.
        cell: the cell.
        guide: where means are far from the graphs of laws and bounds; None where that is not known.
    """
    found = _far(problem, pivots, cell)
    if guide is not None:
        found = found or _guided(problem, cell, guide)
    found = found or list(_any(problem, cell))
    return [replace(part, share=cell.share / len(found)) for part in found]


def at_bounds(problem: ScalarProblem, cell: Box) -> Mask:
    """Where a bound of the problem can push, and the unknown is free to leave it.

    Args:
        problem: the problem.
        cell: the cell.
    """
    ends = (cell.low <= problem.lower) | (cell.high >= problem.upper)
    return np.asarray(ends & (cell.low < cell.high))


def _far(problem: ScalarProblem, pivots: Integers, cell: Box) -> list[Box]:
    """Growing parts of the widest interval of a pivot that reaches far: near the joints, and far on either side."""
    thresholds = problem.thresholds.cells
    begin, end = cell.low[pivots], cell.high[pivots]
    near = np.maximum(problem.joint, np.maximum(begin, -end))
    most = np.maximum(end, -begin)
    wide = np.flatnonzero((end - begin > thresholds.wide * problem.joint) & (most > thresholds.ratio * near))
    if not wide.size:
        return []
    j = wide[np.argmax((end - begin)[wide])]
    at = math.sqrt(near[j] * most[j])
    marks = [float(begin[j]), *(mark for mark in (-at, at) if begin[j] < mark < end[j]), float(end[j])]
    return [_with(cell, int(pivots[j]), first, last) for first, last in itertools.pairwise(marks)]


def _guided(problem: ScalarProblem, cell: Box, guide: Guide) -> list[Box]:
    """Parts where the mean is farthest from a graph."""
    free = cell.low < cell.high
    law, bound = np.where(free, guide.law, 0.0), np.where(free & at_bounds(problem, cell), guide.bound, 0.0)
    i, j = int(np.argmax(law)), int(np.argmax(bound))
    if max(law[i], bound[j]) <= 0.0:
        return []
    return list(off_bound(problem, cell, j) if bound[j] >= law[i] else _near(problem, cell, i, float(guide.x[i])))


def _near(problem: ScalarProblem, cell: Box, i: int, x: float) -> Iterator[Box]:
    """Parts at the joint that is nearest to a place; at the place if there is none, or only a bend near an end."""
    low, high = float(cell.low[i]), float(cell.high[i])
    short = problem.thresholds.cells.off_end * (high - low)
    at, jump = min(_joints(problem, cell, i), key=lambda joint: abs(joint[0] - x), default=(low, 0.0))
    if _jumps(problem, i, jump) or low + short <= at <= high - short:
        return _at_joint(problem, cell, i, at, jump)
    return _halves(cell, i, min(max(x, low + short), high - short))


def _any(problem: ScalarProblem, cell: Box) -> Iterator[Box]:
    """Parts at a drop where there is one, else at a joint, else at a bound."""
    arcs = problem.arcs
    drops = arcs.drops(cell.low, cell.high)
    if drops.any():
        i = int(np.argmax(drops / np.maximum(np.diag(problem.stiffness), 1e-300)))
        chosen = [joint for joint in _joints(problem, cell, i) if joint[1] < -problem.arcs.rounding[i]]
        return _at_joint(problem, cell, i, *chosen[len(chosen) // 2])
    joints = np.where(cell.low < cell.high, arcs.meets(cell.low, cell.high).sum(axis=1) - 1, -1)
    if joints.max() > 0:
        i = int(np.argmax(joints))
        chosen = _joints(problem, cell, i)
        return _at_joint(problem, cell, i, *chosen[len(chosen) // 2])
    return off_bound(problem, cell, int(np.argmax(at_bounds(problem, cell))))


def _joints(problem: ScalarProblem, cell: Box, i: int) -> list[tuple[float, float]]:
    """The joints of a law inside a cell, and the rise of its traction there."""
    arcs = on_interval(problem.chains[i], float(cell.low[i]), float(cell.high[i]))
    return [(a.high, b.rate(b.low) - a.rate(a.high)) for a, b in itertools.pairwise(arcs)]


def _at_joint(problem: ScalarProblem, cell: Box, i: int, at: float, jump: float) -> Iterator[Box]:
    if _jumps(problem, i, jump):  # looked at last: a minimiser is on no drop
        yield _with(cell, i, at, at)
    yield from _halves(cell, i, at)


def _jumps(problem: ScalarProblem, i: int, jump: float) -> bool:
    return abs(jump) > float(problem.arcs.rounding[i])


def _halves(cell: Box, i: int, at: float) -> Iterator[Box]:
    yield _with(cell, i, cell.low[i], at)
    yield _with(cell, i, at, cell.high[i])


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
