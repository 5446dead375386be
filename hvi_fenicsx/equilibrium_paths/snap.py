"""How a body snaps from a state that is not stable to the next stable equilibrium at the same loads.

A force t c holds it back, against the unstable direction, while it goes: the loads f(λ) + t c, t < 0, give a curve of
equilibria that begins at the state with t = 0 (:mod:`.tracer`). The energy falls along it, dE = t cᵀdx, and where t is
0 again is an equilibrium of the loads alone. Where the curve goes on for ever with t < 0 a body comes off; with t = 0
it is in equilibrium wherever it goes. Bonds remember on the way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from ..reduced.condensed_stiffness import CellInverse
from ..typing import Array
from .bonds import BondTable
from .cells import Cells
from .passing import go_on
from .placing import place
from .softest import softest
from .step import FACTOR
from .tracer import Tracer


@dataclass(frozen=True, kw_only=True)
class Snap:
    """Where a body went.

    Attributes:
        cells: the stable equilibrium; None: the body comes off.
        inverse: of its equations; None where it is not known.
    """

    cells: Cells | None
    inverse: CellInverse | None = None


def snap(
    bonds: BondTable, load: Array, path: Tracer, moved: int, direction: int, step: Callable[[], None]
) -> Snap | None:
    """Follow the curve with the first restraint that leads to an end; None where none does.

    Args:
        bonds: the bonds, which remember.
        load: f, (n,).
        path: the curve, at a state that is not stable.
        moved: the unknown whose passage made it so.
        direction: of that unknown along its graph, 1 or -1.
        step: called before each step; it may end the search by an exception.
    """
    memory, cells = bonds.memory, path.cells
    try:
        inverse = path.inverse() or cells.inverse()
    except np.linalg.LinAlgError:
        return None
    for tried in _restraints(bonds, cells, inverse, moved, direction):
        restraint = cells.unresisted(tried).balanced
        held = _held_back(bonds, load, cells, restraint, inverse)
        if held is None or held.rates[moved] * direction <= 0.0:
            continue
        with suppress(np.linalg.LinAlgError):
            found = _to_its_end(held, bonds, load, restraint, step)
            if found is not None:
                return found
        bonds.restore(memory)
    return None


def _restraints(bonds: BondTable, cells: Cells, inverse: CellInverse, moved: int, direction: int) -> Iterator[Array]:
    """Forces against the unstable direction, of size 1: equal on all bonds that it moves, then as it is."""
    own, free = np.eye(1, len(cells), moved)[0], cells.moving
    if cells.rise[moved]:  # on a drop: the unknown goes on, and all others follow
        way = direction if cells.rise[moved] < 0.0 else direction * cells.rise[moved]
        pull = np.where(free, -way * bonds.problem.elastic.column(moved), 0.0)
        unstable = np.where(free, inverse.solve(pull), way * own)
    else:
        unstable = softest(cells, inverse, own, bonds.thresholds.softest)
        unstable *= np.sign(unstable[moved]) * direction or 1.0
    size = float(np.max(np.abs(unstable), initial=0.0))
    if size == 0.0:
        return
    even = bonds.weights * np.sign(np.where(np.abs(unstable) > 1e-6 * size, unstable, 0.0))
    if np.any(even):
        yield np.asarray(even / np.max(np.abs(even)))
    yield np.asarray(unstable / size)
    yield own * direction


def _held_back(bonds: BondTable, load: Array, cells: Cells, restraint: Array, inverse: CellInverse) -> Tracer | None:
    """The curve of one restraint; None where there is none."""
    chains = [cells.chain(i) for i in range(len(cells))]
    stiffness = bonds.problem.elastic
    here = place(stiffness, chains, cells.x, load - stiffness @ cells.x, cells.numbers)
    try:
        return Tracer(stiffness, load, restraint, here, 0.0, heading=-1, inverse=inverse, thresholds=bonds.thresholds)
    except np.linalg.LinAlgError:
        return None


def _to_its_end(tracer: Tracer, bonds: BondTable, load: Array, c: Array, going: Callable[[], None]) -> Snap | None:
    none = bonds.thresholds.balanced * float(np.max(np.abs(load), initial=0.0))
    fall, turnover, standing = 0.0, 1e-3 * float(np.abs(tracer.cells.x) @ np.abs(load)), 0
    for _ in range(1_000 + 100 * len(tracer.cells)):
        going()
        t, x = tracer.factor, tracer.cells.x
        step = tracer.advance(0.0)
        standing = standing + 1 if np.allclose(tracer.cells.x, x, rtol=1e-12, atol=0.0) else 0
        if standing > bonds.thresholds.standing + 4 * len(x):
            return None
        for_ever = step.variable is None
        if for_ever and not (tracer.stands and tracer.factor <= none):
            return None
        if for_ever and tracer.factor < -none:
            return Snap(cells=None)
        step_fall = -0.5 * (t + tracer.factor) * float(c @ (tracer.cells.x - x))
        fall, turnover = fall + step_fall, turnover + abs(step_fall)
        if step.variable == FACTOR or for_ever:
            other = for_ever or fall > 1e-9 * turnover
            landed = other and tracer.cells.is_stable()
            return Snap(cells=tracer.cells, inverse=tracer.inverse()) if landed else None
        go_on(tracer, bonds, step)
    return None
