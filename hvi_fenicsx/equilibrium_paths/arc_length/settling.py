"""Where a small part of the loads takes a body that nothing holds at rest, and back to no load."""

from __future__ import annotations

import numpy as np

from ...reduced.condensed_problem import CondensedProblem
from ...typing import Array
from ..settling import Nowhere, no_load
from ..watch import Watch
from .curve import Curve
from .equations import Refused
from .events import Outcome
from .passage import advancing, set_out
from .relaxation import Relaxation
from .sites import Sites


def settled(
    problem: CondensedProblem, sites: Sites, z: Array, first: float, lag: Array, watch: Watch, *, held: bool
) -> Array | Nowhere:
    """The coordinates at the factor 0, (n,), or why there are none.

    The body moves as an overdamped one until something holds it; then the load is taken off again.

    Args:
        problem: the problem, without constant loads.
        sites: where they are at rest; after it, where they are then.
        z: their coordinates at rest, (n,).
        first: the small factor.
        lag: an order of the sites, (m,).
        watch: whether to stop, and who is told of the motion.
        held: whether there is an equilibrium at this factor, so that no way leads off.
    """
    watch.jumps(first)
    motion = Relaxation(problem, sites, z, problem.load(first), lag, held=held, step=watch.step)
    if not motion.run(np.zeros(len(sites))) or motion.escapes:
        return Nowhere.AWAY if motion.escapes else Nowhere.UNKNOWN
    try:
        curve = Curve(problem.force, problem.force_rate, sites, motion.z, first)
        found = _unloaded(curve, no_load(problem, curve.here.values.x, first, sites.thresholds.settling), lag, watch)
    except (Refused, np.linalg.LinAlgError):
        found = None
    return Nowhere.UNKNOWN if found is None else found


def _unloaded(curve: Curve, none: float, lag: Array, watch: Watch) -> Array | None:
    """The coordinates where a curve comes to the factor 0, straight from one that is none."""
    limits = curve.sites.thresholds.settling
    set_out(curve, -np.sign(curve.factor), lag, watch.step)
    for move in advancing(curve, 0.0, lag, watch.step, limits.steps + limits.more_steps * len(curve.sites)):
        if abs(curve.factor) <= none:
            return curve.correct(curve.here.y, curve.at_factor(0.0))[:-1]
        if move.outcome in (Outcome.AWAY, Outcome.STUCK):
            return None
    return None
