"""The parts of a cell of a problem with laws of lengths."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..typing import Array, Integers
from .arcs import on_interval
from .balance_programme import Guide
from .boxes import Box, fresh_box
from .cell_parts import at_bounds, off_bound, parts
from .length_ranges import Ranges
from .scalar_problem import ScalarProblem

LEAST = float(np.nextafter(0.0, 1.0))


def length_parts(ranges: Ranges, cell: Box, pivots: Integers, guide: Guide | None) -> list[Box]:
    """The parts of a cell, the one to look at first last; none where it is too small to be divided.

    Joints of the laws of lengths come first, then bounds of the vectors: where a bound holds an opening, the law is one
    of the slip alone. Then what takes off most energy, a length or what the guide tells.

    Args:
        ranges: the intervals of the cell.
        cell: the cell.
        pivots: unknowns that fix the rigid motions.
        guide: where means are far from the graphs of laws of one component and bounds.
    """
    springs, losses = ranges.as_springs(), _losses(ranges)
    box = replace(fresh_box(ranges.x[0], ranges.x[1], cell.x), share=cell.share)
    guides = [] if guide is None else [guide]
    if not np.any((losses > 0.0) & (ranges.laws.meets(*ranges.r).sum(axis=1) > 1)):
        bound = _bound_of_vector(ranges, springs, box, guides)
        if bound is not None:
            return _as_cells(ranges, cell, off_bound(springs, box, bound))
    others = max((float(max(g.law.max(initial=0.0), g.bound.max(initial=0.0))) for g in guides), default=0.0)
    divisible = _is_divisible(springs, box)
    for v in np.argsort(-losses, kind="stable"):
        if losses[v] <= 0.0 or (losses[v] <= others and divisible):
            break
        found = list(_of_vector(ranges, int(v), cell))
        if found:
            return [replace(part.cell(cell), share=cell.share / len(found)) for part in found]
    return _as_cells(ranges, cell, parts(springs, pivots, box, guides)) if divisible else []


def _losses(ranges: Ranges) -> Array:
    """What the errors of the springs take off, as energies, (m,)."""
    wide = (ranges.x[1] - ranges.x[0])[ranges.lengths.unknowns] * np.abs(ranges.lengths.factors)
    return np.asarray((ranges.springs[2] * wide).sum(axis=1))


def _bound_of_vector(ranges: Ranges, springs: ScalarProblem, box: Box, guides: Sequence[Guide]) -> int | None:
    """An unknown of a vector that a bound can push, where that takes off most energy; None if there is none."""
    members = ranges.lengths.members
    pushed = members[at_bounds(springs, box)[members]]
    if not pushed.size:
        return None
    return int(pushed[np.argmax(guides[0].bound[pushed])] if guides else pushed[0])


def _as_cells(ranges: Ranges, cell: Box, boxes: Iterable[Box]) -> list[Box]:
    """Parts of the unknowns' intervals as cells, with their shares of the search."""
    found = list(boxes)
    share = sum(part.share for part in found) / cell.share
    return [
        replace(ranges, x=np.stack([part.low, part.high])).cell(replace(cell, share=part.share / share))
        for part in found
    ]


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


def _with(ranges: Ranges, name: Literal["x", "r", "g"], i: int, low: float | None, high: float | None) -> Ranges:
    every = {"x": ranges.x, "r": ranges.r, "g": ranges.g}
    every[name] = ends = every[name].copy()
    for k, end in enumerate((low, high)):
        if end is not None:
            ends[k, i] = end
    return replace(ranges, x=every["x"], r=every["r"], g=every["g"])
