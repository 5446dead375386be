"""Where a small part of the loads takes a body that nothing holds at rest, and back to no load."""

from __future__ import annotations

from enum import Enum

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .descent import Descent
from .passing import go_on
from .placing import place
from .step import FACTOR
from .thresholds import SettlingThresholds
from .tracer import Tracer


class Nowhere(Enum):
    """Why a body that nothing holds at rest has no first state."""

    AWAY = "nothing holds the body at rest"
    UNKNOWN = "nothing holds the body at rest, and no state was found to which a small load takes it"


def settled(bonds: BondTable, problem: CondensedProblem, rest: Array, limits: SettlingThresholds) -> Cells | Nowhere:
    """Where the unknowns are at no load, or why nowhere.

    Args:
        bonds: the bonds and what they remember; changed.
        problem: the problem, without constant loads.
        rest: displacements at which nothing holds the body, (n,).
        limits: of the small load.
    """
    chains = [bonds.chain(i) for i in range(problem.size)]
    first = limits.first_load
    load = problem.load(first)
    start = np.clip(rest, problem.lower, problem.upper)
    landing = Descent(bonds, load).land(start, start)
    if not landing.found:
        return Nowhere.AWAY if landing.escapes else Nowhere.UNKNOWN
    cells = place(problem.elastic, chains, landing.x, load - problem.elastic @ landing.x)
    equations = problem.elastic, problem.force, problem.force_rate
    tracer = Tracer(*equations, cells, first, heading=-1, thresholds=bonds.thresholds)
    small = no_load(problem, landing.x, first, limits)
    while tracer.factor > small:
        step = tracer.advance(small)
        if step.variable is None:
            return Nowhere.UNKNOWN
        if step.variable != FACTOR:
            go_on(tracer, bonds, step)
    return _unloaded(tracer.cells, small * problem.force_rate)


def no_load(problem: CondensedProblem, x: Array, first: float, limits: SettlingThresholds) -> float:
    """A factor that is none: beside the first one, and beside the rounding of the elastic forces.

    Args:
        problem: the problem.
        x: displacements, (n,).
        first: a small factor.
        limits: what is none.
    """
    stiffest = float(np.max(problem.elastic.diagonal, initial=0.0))
    rounding = np.finfo(float).eps * stiffest * float(np.max(np.abs(x), initial=0.0))
    load = float(np.max(np.abs(problem.force_rate), initial=0.0)) or 1.0
    return max(limits.no_load * abs(first), limits.roundings * rounding / load)


def _unloaded(cells: Cells, load: Array) -> Cells:
    """The cell without its last load: to events at no load rounding would give an order."""
    cells.tau -= cells.inverse().solve(load)
    return cells
