"""Where a path begins: the equilibrium under the constant loads alone, at the factor 0."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .placing import place
from .programme import constant_alone
from .settling import Nowhere, settled
from .thresholds import DEFAULT, Thresholds


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
    constant = constant_alone(problem, x, force)
    cells = place(problem.elastic, chains, x, force)
    if cells.is_singular():
        next_loads = constant or replace(problem, force=held, force_rate=aim * problem.force_rate)
        found = settled(bonds, next_loads, np.zeros(problem.size), thresholds.settling)
        if isinstance(found, Nowhere):
            off = found is Nowhere.AWAY
            return Beginning(cells=None, memory=bonds.memory, reason=found.value, escapes=off)
        cells = found
    return Beginning(cells=cells, memory=bonds.memory, constant=constant)


def _nearest(bonds: BondTable, x: Array, wanted: Array) -> Array:
    """The forces of laws and bounds at given displacements, as near to wanted ones as they can be, (n,)."""
    problem, found = bonds.problem, np.zeros_like(x)
    for i in range(len(x)):
        forces = [s.force_at(float(x[i])) for s in bonds.chain(i) if s.stands_at(float(x[i]))]
        found[i] = min(forces, key=abs) if forces else 0.0
    return np.where((problem.lower == problem.upper), wanted, found)
