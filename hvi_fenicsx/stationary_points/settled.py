"""Intervals that are shorter than rounding about a jump of a law, or at a bound, become that place.

About such a place at zero intervals are clipped again and again, and never end there, lest its tractions are lost
(`least_widened`). The place has all tractions that the interval has, to rounding: a jump those of both its sides, and a
bound that bears nothing that of the law. And the forces of others change by less than rounding.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .boxes import Box, clipped
from .scalar_problem import ScalarProblem


def settled(problem: ScalarProblem, cell: Box) -> Box:
    """The cell with such intervals made places.

    Args:
        problem: the problem.
        cell: the cell.
    """
    n, arcs = problem.size, problem.arcs
    low, high = cell.low[:n], cell.high[:n]
    short = (low < high) & (high - low < problem.thresholds.cells.settled)
    if not short.any():
        return cell
    at = arcs.high[:n, :-1]
    jumps = np.abs(arcs.after[:n, 1:] - arcs.before[:n, :-1]) > arcs.rounding[:n, None]
    inside = jumps & (at > low[:, None]) & (at < high[:, None])
    places = np.where(inside, at, np.inf).min(axis=1, initial=np.inf)
    places = np.where(low <= problem.lower, low, np.where(high >= problem.upper, high, places))
    there = short & np.isfinite(places)
    ends = [cell.low.copy(), cell.high.copy()]
    for end in ends:
        end[:n][there] = places[there]
    return replace(cell, low=ends[0], high=ends[1], x=clipped(cell.x, *ends))
