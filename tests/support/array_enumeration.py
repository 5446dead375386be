"""All stationary points of a small condensed problem with polyline laws, by brute force over the pieces of the laws.

Each unknown is on a piece of its law, at a joint, or at a bound; each combination is a linear system and a sign check.
Nothing of the search is used; of the problem only its arrays and the pieces of its laws.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
SLACK = 1e-9


class State(NamedTuple):
    """On a piece: traction = at + slope x for low ≤ x ≤ high; standing: x = at, and the force is from low to high."""

    stands: bool
    at: float
    slope: float
    low: float
    high: float


def states(chain: Any, lower: float, upper: float) -> Iterator[State]:
    """The states of one unknown, its law being a chain of parabolas."""
    for arc in chain:
        if max(arc.low, lower) < min(arc.high, upper):
            at = arc.traction - arc.slope * arc.anchor
            yield State(False, at, arc.slope, max(arc.low, lower), min(arc.high, upper))
    for one, other in itertools.pairwise(chain):
        if lower < one.high < upper:
            tractions = sorted((one.rate(one.high), other.rate(one.high)))
            yield State(True, one.high, 0.0, *tractions)
    for bound, first, last in ((lower, -np.inf, None), (upper, None, np.inf)):
        if np.isfinite(bound):
            tractions = [arc.rate(bound) for arc in chain if arc.low <= bound <= arc.high]
            low, high = first or min(tractions), last or max(tractions)
            yield State(True, bound, 0.0, low, high) if lower < upper else State(True, bound, 0.0, -np.inf, np.inf)


def stationary(problem: Any) -> list[Array]:
    """All isolated points x for which f - Sx is a force that laws and bounds can bear."""
    ends = zip(problem.chains, problem.lower, problem.upper, strict=True)
    found: list[Array] = []
    for combination in itertools.product(*(list(states(*end)) for end in ends)):
        x = _solution(problem, combination)
        if x is not None and not any(np.max(np.abs(x - y)) < 1e-7 * (1.0 + np.max(np.abs(y))) for y in found):
            found.append(x)
    return found


def _solution(problem: Any, combination: tuple[State, ...]) -> Array | None:
    stands, at, slope, low, high = (np.array(column) for column in zip(*combination, strict=True))
    x, free = np.where(stands, at, 0.0), np.flatnonzero(~stands)
    matrix = problem.stiffness + np.diag(slope)
    block = matrix[np.ix_(free, free)]
    if free.size and not np.linalg.cond(block) < 1e11:
        return None
    x[free] = np.linalg.solve(block, (problem.force - np.where(stands, 0.0, at) - problem.stiffness @ x)[free])
    force = problem.force - problem.stiffness @ x
    size = np.where(stands, np.abs(problem.force).max() + 1.0, 1.0 + np.abs(x))
    judged = np.where(stands, force, x)
    return x if np.all((judged >= low - SLACK * size) & (judged <= high + SLACK * size)) else None
