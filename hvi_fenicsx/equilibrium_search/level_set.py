"""A finite box that holds all points whose energy is at most a given one.

Strong convexity of the relaxation bounds displacements other than rigid motions. How far a rigid motion c can go is
bounded by the dual: c·x ≤ (E - min over x of (relaxation - τ c·x))/τ for each force τ > 0 at which that minimum exists.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..errors import SolverError
from ..typing import Array
from .boxes import Box
from .curvature import Curvature, kernel
from .relaxation import Relaxation
from .scalar_problem import ScalarProblem


class Cut(Exception):
    """The search stops before there is a first box."""


def level_set(
    problem: ScalarProblem, box: Box, curvature: Curvature, level: float, cut: Callable[[], bool]
) -> tuple[Array, Array]:
    """The ends of a box (n + m,) with all points of at most an energy.

    Args:
        problem: the problem.
        box: the relaxation's solution on a box that is far larger.
        curvature: of that relaxation.
        level: the energy.
        cut: whether to give up, since the search stops.

    Raises:
        SolverError: no finite box was found.
        Cut: the search stops.
    """
    energy = level + problem.thresholds.bounds.slack * problem.energy_size(box.x)
    root = np.sqrt(2.0 * max(energy - box.value, 0.0))
    n = problem.size
    low, high = box.x - root * curvature.radii[:n], box.x + root * curvature.radii[:n]
    free = np.flatnonzero(~np.isfinite(curvature.radii[:n]))
    if free.size:
        motions = _apart(problem, kernel(problem))
        spread = np.abs(motions[free]) @ _reach(problem, box, motions, energy, cut)
        around = root * curvature.range_radii[free] + spread
        low[free], high[free] = box.x[free] - around, box.x[free] + around
    return problem.with_lengths(np.maximum(low, box.low[:n]), np.minimum(high, box.high[:n]))


def _apart(problem: ScalarProblem, motions: Array) -> Array:
    """The same motions, those that bounds cannot hold apart from others, as these may have no limit."""
    bounded = np.isfinite(problem.lower) | np.isfinite(problem.upper)
    if not bounded.any():
        return motions
    turn = np.linalg.svd(motions[bounded])[2]
    return np.asarray(motions @ turn.T)


def _reach(problem: ScalarProblem, box: Box, motions: Array, energy: float, cut: Callable[[], bool]) -> Array:
    """How far the share of each rigid motion can be from that of x, (k,)."""
    result = []
    for c in motions.T:
        here = float(c @ box.x)
        result.append(max(_farthest(problem, box, sign * c, energy, cut) - sign * here for sign in (1.0, -1.0)))
    return np.array(result)


def _farthest(problem: ScalarProblem, box: Box, c: Array, energy: float, cut: Callable[[], bool]) -> float:
    """A bound of c·x from above."""
    best, tau = np.inf, float(np.max(np.abs(problem.force), initial=1e-300))
    for _ in range(problem.thresholds.bounds.most_forces):
        pulled = Relaxation(problem.under(problem.force + tau * c), cut)
        found, _ = pulled.solve(replace(box, bound=-np.inf), 0.9)
        if cut():
            raise Cut
        if not np.any(
            (found.x <= box.low[: problem.size]) & np.isneginf(problem.lower)
            | (found.x >= box.high[: problem.size]) & np.isposinf(problem.upper)
        ):
            bound = (energy - found.bound) / tau
            if bound >= best:
                return best
            best = bound
        tau *= 0.25
    if not np.isfinite(best):
        raise SolverError("no lowest energy: a body can move away without end for all that can be shown")
    return best
