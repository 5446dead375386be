"""Where a path begins: the equilibrium under the constant loads alone, at the factor 0."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from ..system.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .descent import Descent
from .passing import go_on
from .placing import place
from .step import FACTOR
from .thresholds import DEFAULT, SettlingThresholds, Thresholds
from .tracer import Tracer


class Nowhere(Enum):
    """Why a body that nothing holds at rest has no first state."""

    AWAY = "nothing holds the body at rest"
    UNKNOWN = "nothing holds the body at rest, and no state was found to which a small load takes it"
    NEUTRAL = "nothing holds the body at rest, and where a small load takes it, it may still move without a force"


@dataclass(frozen=True, kw_only=True)
class Beginning:
    """The first state.

    Attributes:
        cells: where the unknowns are; None: there is no such state.
        memory: what the bonds remember, (bonds, 4).
        reason: why there is none.
        escapes: whether there is none since the body comes off.
        constant: the path from there to the constant loads, its factor from 0 to 1; None where there are none.
    """

    cells: Cells | None
    memory: Array
    reason: str = ""
    escapes: bool = False
    constant: CondensedProblem | None = None


def at_rest(
    problem: CondensedProblem, remember: Collection[int], aim: float, thresholds: Thresholds = DEFAULT
) -> Beginning:
    """The state at the factor 0, before constant loads act: these are applied along a path of their own.

    Args:
        problem: the problem.
        remember: numbers of the problem's bonds that remember.
        aim: the factor that the path goes to first.
        thresholds: of the path.
    """
    bonds = BondTable(problem, remember, thresholds.exact)
    chains = [bonds.chain(i) for i in range(problem.size)]
    x = np.clip(np.zeros(problem.size), problem.lower, problem.upper)
    force = _nearest(bonds, x, problem.force - problem.elastic @ x)
    held = problem.elastic @ x + force
    away = problem.force - held
    size = float(np.max(np.abs(held), initial=0.0)) + float(np.max(np.abs(problem.force), initial=0.0))
    rate = away if np.max(np.abs(away), initial=0.0) > 1e-14 * size else aim * problem.force_rate
    cells = place(problem.elastic, chains, x, force)
    if cells.is_singular():
        settled = _settled(bonds, replace(problem, force=held, force_rate=rate), thresholds.settling)
        if isinstance(settled, Nowhere):
            off = settled is Nowhere.AWAY
            return Beginning(cells=None, memory=bonds.memory, reason=settled.value, escapes=off)
        cells = settled
    if rate is not away:
        return Beginning(cells=cells, memory=bonds.memory)
    alone = replace(problem, force=held, force_rate=away)
    return Beginning(cells=cells, memory=bonds.memory, constant=alone)


def _nearest(bonds: BondTable, x: Array, wanted: Array) -> Array:
    """The forces of laws and bounds at given displacements, as near to wanted ones as they can be, (n,)."""
    problem, found = bonds.problem, np.zeros_like(x)
    for i in range(len(x)):
        forces = [s.force_at(float(x[i])) for s in bonds.chain(i) if s.stands_at(float(x[i]))]
        found[i] = min(forces, key=abs) if forces else 0.0
    return np.where((problem.lower == problem.upper), wanted, found)


def _settled(bonds: BondTable, problem: CondensedProblem, limits: SettlingThresholds) -> Cells | Nowhere:
    """Where a small part of the loads takes a body that nothing holds at rest, and back to no load; or why nowhere.

    All contacts end at no load, and rounding says which one is first: those that do so at a load that is rounding are
    still closed where the path begins.
    """
    chains = [bonds.chain(i) for i in range(problem.size)]
    first = limits.first_load
    load = problem.load(first)
    start = np.clip(np.zeros(problem.size), problem.lower, problem.upper)
    landing = Descent(bonds, load).land(start, start)
    if not landing.found:
        return Nowhere.AWAY if landing.escapes else Nowhere.UNKNOWN
    cells = place(problem.elastic, chains, landing.x, load - problem.elastic @ landing.x)
    equations = problem.elastic, problem.force, problem.force_rate
    tracer = Tracer(*equations, cells, first, heading=-1, thresholds=bonds.thresholds)
    rounding = _rounding(problem, cells.x)
    while True:
        step = tracer.advance(0.0)
        if step.variable is None:
            return Nowhere.UNKNOWN
        if step.variable == FACTOR or abs(tracer.factor) <= max(limits.no_load * first, limits.roundings * rounding):
            return Nowhere.NEUTRAL if tracer.cells.is_singular() else tracer.cells
        go_on(tracer, bonds, step)


def _rounding(problem: CondensedProblem, x: Array) -> float:
    """The factor of a load that is no larger than the rounding of the elastic forces."""
    elastic = float(np.max(problem.elastic.diagonal)) * float(np.max(np.abs(x)))
    return float(np.finfo(float).eps) * elastic / (float(np.max(np.abs(problem.force_rate))) or 1.0)
