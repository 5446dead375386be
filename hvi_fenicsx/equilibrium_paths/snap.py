"""How a body snaps from a state that is not stable to the next stable equilibrium at the same loads.

A force t c holds it back, against the unstable direction, while it goes: the loads f(λ) + t c, t < 0, give a curve of
equilibria that begins at the state with t = 0 (:mod:`.tracer`). The energy falls along it, dE = t cᵀdx, and where t is
0 again is an equilibrium of the loads alone. Where the curve goes on for ever with t < 0 a body comes off. Bonds
remember on the way.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .passing import go_on
from .placing import place
from .step import FACTOR
from .tracer import Tracer

_STANDING = 20
"""So many events at one place, and four for each unknown, lead nowhere."""


@dataclass(frozen=True, kw_only=True)
class Snap:
    """Where a body went.

    Attributes:
        cells: the stable equilibrium; None: the body comes off.
        fall: of the energy.
    """

    cells: Cells | None
    fall: float


def snap(bonds: BondTable, load: Array, cells: Cells, moved: int, direction: int) -> Snap | None:
    """Follow the curve with the first restraint that leads to an end; None where none does.

    Args:
        bonds: the bonds, which remember.
        load: f, (n,).
        cells: the state that is not stable.
        moved: the unknown whose passage made it so.
        direction: of that unknown along its graph, 1 or -1.
    """
    memory = bonds.memory
    for restraint in _restraints(bonds, cells, moved, direction):
        found = _followed(bonds, load, cells, restraint, (moved, direction))
        if found is not None:
            return found
        bonds.restore(memory)
    return None


def _restraints(bonds: BondTable, cells: Cells, moved: int, direction: int) -> Iterator[Array]:
    """Forces against the unstable direction: of equal size on all bonds that it moves, then as it is."""
    matrix, free = cells.tangent()
    unstable = np.zeros(len(cells))
    if cells.rise[moved]:  # on a drop: the unknown goes on, and all others follow
        unstable[moved] = direction * cells.rise[moved]
        if cells.rise[moved] < 0.0:
            unstable[moved] = direction
        unstable[free] = -np.linalg.lstsq(matrix, bonds.problem.stiffness[free, moved] * unstable[moved])[0]
    elif free.size:
        _, vectors = eigh(matrix, subset_by_index=[0, 0])
        unstable[free] = vectors[:, 0]
        unstable *= np.sign(unstable[moved]) * direction or 1.0
    size = float(np.max(np.abs(unstable), initial=0.0))
    if size == 0.0:
        return
    yield bonds.weights * np.sign(np.where(np.abs(unstable) > 1e-6 * size, unstable, 0.0))
    yield unstable
    yield np.eye(1, len(cells), moved)[0] * direction


def _followed(bonds: BondTable, load: Array, cells: Cells, restraint: Array, passed: tuple[int, int]) -> Snap | None:
    """Along the curve of one restraint; None where it leads to no end."""
    size = float(np.max(np.abs(restraint), initial=0.0))
    if size == 0.0:
        return None
    c = np.asarray(restraint / size, dtype=np.float64)
    chains = [cells.chain(i) for i in range(len(cells))]
    problem = bonds.problem
    here = place(problem.stiffness, chains, cells.x, load - problem.stiffness @ cells.x, cells.numbers)
    try:
        tracer = Tracer(problem.stiffness, load, c, here, 0.0, driver=FACTOR, heading=-1)
    except np.linalg.LinAlgError:
        return None
    moved, direction = passed
    if tracer.rates[moved] * direction <= 0.0:
        return None
    return _to_its_end(tracer, bonds, load, c)


def _to_its_end(tracer: Tracer, bonds: BondTable, load: Array, c: Array) -> Snap | None:
    fall, turnover, standing = 0.0, 1e-3 * float(np.abs(tracer.cells.x) @ np.abs(load)), 0
    for _ in range(1_000 + 100 * len(tracer.cells)):
        t, x = tracer.factor, tracer.cells.x
        step = tracer.advance(0.0)
        standing = standing + 1 if np.allclose(tracer.cells.x, x, rtol=1e-12, atol=0.0) else 0
        if standing > _STANDING + 4 * len(x):
            return None
        if step.variable is None:
            free = tracer.factor < 0.0 and tracer.stands
            return Snap(cells=None, fall=np.inf) if free else None
        step_fall = -0.5 * (t + tracer.factor) * float(c @ (tracer.cells.x - x))
        fall, turnover = fall + step_fall, turnover + abs(step_fall)
        if step.variable == FACTOR:
            stable = tracer.cells.unstable_directions() == 0
            return Snap(cells=tracer.cells, fall=fall) if stable and fall > 1e-9 * turnover else None
        go_on(tracer, bonds, step)
    return None
