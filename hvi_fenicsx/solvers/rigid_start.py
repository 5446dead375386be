"""A start for bodies that contact holds: as rigid bodies, they rest on a few vertices of Γc.

From contact closed everywhere, the active set shrinks to the vertices that bear the load. Where a body rolls or tips on
the way, some of these sets do not hold it: the tangent is singular, and a step has any length. From the vertices on
which the rigid body rests, the active set grows instead. Their reactions are the multipliers of the bounds; where the
support is statically determinate, no elastic deformation changes them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from petsc4py import PETSc

from ..laws import Superpotential
from ..rigid import Sides
from ..runtime.mpi import agree
from ..system.law_model import LawModel
from ..system.system import System
from ..typing import Integers
from . import rigid_position
from .closed_start import contact_dofs
from .context import SolveContext


def at_rest(
    context: SolveContext,
    laws: Sequence[Superpotential],
    models: Callable[[PETSc.Vec], Sequence[LawModel]],
    rtol: float,
) -> tuple[PETSc.Vec, int] | None:
    """The displacement of bodies at rest on their supports, and iterations of the linear solver. Collective.

    Args:
        context: the system and its solver.
        laws: what is solved, by term.
        models: what takes the place of the laws in the elastic step from a displacement, by term.
        rtol: relative tolerance of the linear solve.

    Returns:
        None where nothing holds the bodies, or no rigid motion is left.
    """
    system = context.system
    moves = rigid_position.motions(system, contact_closed=False)
    x = system.undisplaced()
    if not moves:
        return None
    bearing = _rest(system, laws, x, moves)
    if bearing is None:
        return None
    kinks = rigid_position.at_kinks(system, laws, x, context.options.thresholds.touching)
    held = np.setdiff1d(np.union1d(bearing, kinks), system.problem.fixed).astype(np.int32)
    return x, context.solver.newton_step(x, held, models(x), rtol).linear


def _rest(system: System, laws: Sequence[Superpotential], x: PETSc.Vec, moves: Sequence[PETSc.Vec]) -> Integers | None:
    """Move x rigidly to rest, and return the owned unknowns that bear the load: exactly on their bounds. Collective."""
    dofs = contact_dofs(system)
    low, high = (v.array_r[dofs] - x.array_r[dofs] for v in (system.lower, system.upper))
    upper, lower = np.isfinite(high), np.isfinite(low)
    rows = np.column_stack([move.array_r[dofs] for move in moves])
    sides = np.vstack([rows[upper], -rows[lower]]), np.r_[high[upper], -low[lower]]
    mine = np.r_[dofs[upper], dofs[lower]], np.r_[system.upper.array_r[dofs][upper], system.lower.array_r[dofs][lower]]
    every = agree(system.comm, sides)
    whole = Sides(np.concatenate([s[0] for s in every]), np.concatenate([s[1] for s in every]))
    found = rigid_position.settle(system, laws, x, moves, whole)
    if found is None:
        return None
    here = found.bearing - sum(len(s[1]) for s in every[: system.comm.rank])
    here = here[(here >= 0) & (here < len(mine[0]))]
    x.array[mine[0][here]] = mine[1][here]
    return np.unique(mine[0][here])
