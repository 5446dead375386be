"""A finite box that holds all points whose energy is at most a given one.

Strong convexity of the relaxation bounds displacements other than rigid motions. How far a rigid motion c can go is
bounded by the dual: c·x ≤ (E - min over x of (relaxation - τ c·x))/τ for each force τ > 0 at which that minimum exists.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import SolverError
from ..typing import Array
from .boxes import Box
from .relaxation import Minimum, Relaxation
from .scalar_problem import ScalarProblem


class Cut(Exception):
    """The search stops before there is a first box."""


def level_set(
    relaxation: Relaxation, ends: tuple[Array, Array], found: Minimum, level: float, cut: Callable[[], bool]
) -> tuple[Array, Array]:
    """The ends of a box (n + m,) with all points of at most an energy.

    Args:
        relaxation: of the problem.
        ends: of a box that is far larger, (n + m,) each.
        found: the relaxation's minimum there.
        level: the energy.
        cut: whether to give up, since the search stops.

    Raises:
        SolverError: no finite box was found.
        Cut: the search stops.
    """
    problem, n = relaxation.problem, relaxation.problem.size
    energy = level + problem.thresholds.bounds.slack * problem.energy_size(found.x)
    root = np.sqrt(2.0 * max(energy - found.bound, 0.0))
    reach = root * found.curvature.radii[:n]
    free = ~np.isfinite(reach)
    if free.any():
        motions = _separated(problem, relaxation.kernel)
        ways = [_reach(problem, ends, found, motion, energy, cut) for motion in motions.T]
        reach[free] = root * found.curvature.range_radii[:n][free] + np.abs(motions[free]) @ np.array(ways)
    low, high = np.maximum(found.x - reach, ends[0][:n]), np.minimum(found.x + reach, ends[1][:n])
    return problem.with_lengths(low, high)


def _separated(problem: ScalarProblem, motions: Array) -> Array:
    """The same motions, those that bounds cannot hold apart from others, as these may have no limit."""
    bounded = np.isfinite(problem.lower) | np.isfinite(problem.upper)
    return np.asarray(motions @ np.linalg.svd(motions[bounded])[2].T) if bounded.any() else motions


def _reach(
    problem: ScalarProblem,
    ends: tuple[Array, Array],
    found: Minimum,
    motion: Array,
    energy: float,
    cut: Callable[[], bool],
) -> float:
    """How far the share of a rigid motion can be from that of the minimiser."""
    here = float(motion @ found.x)
    return max(_farthest(problem, ends, found, sign * motion, energy, cut) - sign * here for sign in (1.0, -1.0))


def _farthest(
    problem: ScalarProblem,
    ends: tuple[Array, Array],
    found: Minimum,
    c: Array,
    energy: float,
    cut: Callable[[], bool],
) -> float:
    """A bound of c·x from above, by forces each a quarter of the one before."""
    best, tau = np.inf, float(np.max(np.abs(problem.force), initial=1e-300))
    for _ in range(problem.thresholds.programmes.most_steps):
        pulled = Relaxation(problem.under(problem.force + tau * c), cut).solve(Box.around(*ends, found.x))
        if cut():
            raise Cut
        if not problem.is_far(pulled.x):
            bound = (energy - pulled.bound) / tau
            if bound >= best:
                break
            best = bound
        tau *= 0.25
    if not np.isfinite(best):
        raise SolverError("no lowest energy: a body can move away without end for all that can be shown")
    return best
