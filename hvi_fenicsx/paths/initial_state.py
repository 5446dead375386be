"""Where a path begins: at rest, before constant loads act; these are applied along a path of their own.

Where nothing holds a body at rest, a small part of the loads takes it to where something does, and is taken off again.
"""

from __future__ import annotations

from dataclasses import replace
from enum import Enum

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, magnitude
from .branch import Refused, StepEnd, advancing
from .contact_points import ContactPoints
from .curve import branch_from
from .motion import OverdampedMotion
from .segments import Segment
from .thresholds import DEFAULT


class Nowhere(Enum):
    """Why a body that nothing holds at rest has no first state."""

    AWAY = "nothing holds the body at rest"
    UNKNOWN = "nothing holds the body at rest, and no state was found to which a small load takes it"


def at_rest(problem: CondensedProblem, points: ContactPoints) -> tuple[Array, CondensedProblem | None]:
    """The coordinates of the points before any load acts, (n,), and the path from there to the constant loads.

    The points are put there.

    Args:
        problem: the problem.
        points: its points.
    """
    x = np.clip(np.zeros(problem.size), problem.lower, problem.upper)
    z, force = np.zeros(problem.size), np.zeros(problem.size)
    free = problem.force - problem.elastic @ x
    for k in range(len(points)):
        i = int(points.one[k]) if k < len(points.one) else None
        at, wanted = (0.0, 0.0) if i is None else (float(x[i]), float(free[i]))
        number, s_force = _standing(points.chain(k), at, wanted)
        if points.is_opening(k) and not points.chain(k)[number].rise:
            number = len(points.chain(k)) - 1
        points.enter(k, number)
        if i is not None:
            z[i], force[i] = points.coordinate(k, at, s_force), s_force
    return z, _constant_alone(problem, x, force)


def _standing(chain: tuple[Segment, ...], x: float, wanted: float) -> tuple[int, float]:
    """The segment of a displacement that holds best, and its least force; of a fixed unknown the wanted one."""
    if len(chain) == 1 and chain[0].bound:
        return 0, wanted
    on = [n for n, segment in enumerate(chain) if segment.displacement(segment.coordinate(x, segment.force)) == x]
    forces = {n: chain[n].force_at(x) for n in on}
    least = min(abs(f) for f in forces.values())
    best = max((n for n in forces if abs(forces[n]) == least), key=lambda n: chain[n].hold)
    return best, forces[best]


def settled(
    problem: CondensedProblem, points: ContactPoints, z: Array, towards: float, *, held: bool
) -> Array | Nowhere:
    """The coordinates at the factor 0, (n,), or why there are none.

    The body moves as an overdamped one until something holds it; then the load is taken off again.

    Args:
        problem: the problem, without constant loads.
        points: where they are at rest; after it, where they are then.
        z: their coordinates at rest, (n,).
        towards: the factor of which a small part acts.
        held: whether there is an equilibrium at this factor, so that no way leads off.
    """
    first = DEFAULT.small * towards
    motion = OverdampedMotion(problem, points, z, problem.load(first), held=held)
    if not motion.run(np.zeros(len(points))) or motion.escapes:
        return Nowhere.AWAY if motion.escapes else Nowhere.UNKNOWN
    heading, most = -int(np.sign(first)), DEFAULT.waits * (1 + len(points))
    try:
        branch = branch_from(points, problem.force, problem.force_rate, motion.z, first)
        branch.set_out(heading)
        for move in advancing(branch, DEFAULT.none * first, most):
            if move.outcome is StepEnd.FACTOR:
                return branch.balanced(0.0)
            if move.outcome in (StepEnd.AWAY, StepEnd.STUCK):
                break
    except (Refused, np.linalg.LinAlgError):
        pass
    return Nowhere.UNKNOWN


def _constant_alone(problem: CondensedProblem, x: Array, forces: Array) -> CondensedProblem | None:
    """The path from rest to the constant loads, its factor from 0 to 1; None where there are none.

    Rounding of the elastic forces at rest, where a bound lifts the body as a whole, is no load.
    """
    held = problem.elastic @ x + forces
    away, stiffest = problem.force - held, float(np.max(problem.elastic.diagonal, initial=0.0))
    sizes = held, problem.force, stiffest * x
    if magnitude(away) <= 1e-14 * sum(magnitude(f) for f in sizes):
        return None
    return replace(problem, force=held, force_rate=away)
