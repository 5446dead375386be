"""The parts of a cell of a problem with laws of lengths."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..typing import Array, Integers
from .arcs import on_interval
from .balance_programme import Guide
from .boxes import Box, fresh_box
from .cell_parts import at_bounds, parts
from .length_ranges import Ranges
from .scalar_problem import ScalarProblem

LEAST = float(np.nextafter(0.0, 1.0))


def length_parts(ranges: Ranges, cell: Box, pivots: Integers, guide: Guide | None) -> list[Box]:
    """The parts of a cell, the one to look at first last; none where it is too small to be divided.

    Args:
        ranges: the intervals of the cell.
        cell: the cell.
        pivots: unknowns that fix the rigid motions.
        guide: where means are far from the graphs of laws of one component and bounds.
    """
    free = ranges.x[0] < ranges.x[1]
    wide = np.where(free, ranges.x[1] - ranges.x[0], 0.0)[ranges.lengths.unknowns] * np.abs(ranges.lengths.factors)
    losses = (ranges.springs[2] * wide).sum(axis=1)
    others = 0.0 if guide is None else max(float(guide.law.max(initial=0.0)), float(guide.bound.max(initial=0.0)))
    springs = ranges.as_springs()
    box = replace(fresh_box(ranges.x[0], ranges.x[1], cell.x), share=cell.share)
    divisible = _is_divisible(springs, box)
    for v in np.argsort(-losses, kind="stable"):
        if losses[v] <= others and divisible:
            break
        found = [] if losses[v] <= 0.0 else list(_of_vector(ranges, int(v), cell))
        if found:
            return [replace(part.cell(cell), share=cell.share / len(found)) for part in found]
    if not divisible:
        return []
    smaller = parts(springs, pivots, box, [] if guide is None else [guide])
    return [replace(ranges, x=np.stack([p.low, p.high])).cell(replace(cell, share=p.share)) for p in smaller]


def _is_divisible(springs: ScalarProblem, box: Box) -> bool:
    """Whether laws of one component, or bounds, have something to divide."""
    joints = springs.arcs.meets(box.low, box.high).sum(axis=1) > 1
    return bool(np.any(joints & (box.low < box.high)) or np.any(at_bounds(springs, box)))


def _of_vector(ranges: Ranges, v: int, cell: Box) -> Iterator[Ranges]:
    """Parts at a joint of the law, at zero, at no opening, or halves of r, or of g on a drop."""
    short, far = (float(end) for end in ranges.r[:, v])
    law = ranges.problem.chains[ranges.problem.size + v]
    smallest = ranges.problem.thresholds.cells.smallest
    joints = [(a.high, a.rate(a.high), b.rate(b.low)) for a, b in itertools.pairwise(on_interval(law, short, far))]
    if joints:
        here = float(ranges.lengths.of(cell.x)[v])
        yield from _at_joint(ranges, v, *min(joints, key=lambda joint: abs(joint[0] - here)))
    elif ranges.at_zero[v] and far > 0.0:
        yield from _off_zero(ranges, v)
    elif ranges.mixed[v]:
        i, factor = int(ranges.lengths.unknowns[v, 0]), float(ranges.lengths.factors[v, 0])
        yield _with(ranges, "x", i, *((0.0, None) if factor > 0.0 else (None, 0.0)))
        yield _with(ranges, "x", i, *((None, 0.0) if factor > 0.0 else (0.0, None)))
    elif far - short > smallest * far:
        at = 0.5 * (short + far) if far < 16.0 * short else math.sqrt(max(short, 1e-4 * far) * far)
        yield _with(ranges, "r", v, at, None)
        yield _with(ranges, "r", v, None, at)
    elif short == far > 0.0 and np.ptp(ranges.g[:, v]) > smallest * float(np.max(np.abs(ranges.g[:, v]))):
        at = 0.5 * float(ranges.g[:, v].sum())
        yield _with(ranges, "g", v, at, None)
        yield _with(ranges, "g", v, None, at)


def _at_joint(ranges: Ranges, v: int, at: float, before: float, after: float) -> Iterator[Ranges]:
    if abs(after - before) > float(ranges.laws.rounding[v]):  # looked at last: a minimiser is on no drop
        on = _with(ranges, "r", v, at, at)
        yield _with(on, "g", v, min(before, after), max(before, after))
    yield _with(ranges, "r", v, None, at)
    yield _with(ranges, "r", v, at, None)


def _off_zero(ranges: Ranges, v: int) -> Iterator[Ranges]:
    """Parts of a vector that bears a traction at zero: not zero; zero with a negative opening; zero."""
    yield _with(ranges, "r", v, LEAST, None)
    held = _with(ranges, "r", v, 0.0, 0.0)
    i, factor = int(ranges.lengths.unknowns[v, 0]), float(ranges.lengths.factors[v, 0])
    if ranges.lengths.opens[v] and ranges.vectors[0, v, 0] < 0.0:
        yield _with(held, "x", i, *((None, -LEAST) if factor > 0.0 else (LEAST, None)))
        held = _with(held, "x", i, 0.0, 0.0)
    yield held


def _with(ranges: Ranges, name: str, i: int, low: float | None, high: float | None) -> Ranges:
    ends: Array = getattr(ranges, name).copy()
    for k, end in enumerate((low, high)):
        if end is not None:
            ends[k, i] = end
    return replace(ranges, **{name: ends})
