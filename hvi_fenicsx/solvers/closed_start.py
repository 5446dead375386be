"""The resting start, which holds every rigid motion: contact closed, laws at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from ..laws import Superpotential
from ..system import existence
from ..system.system import LawModel, System
from ..typing import Array, Entities, Integers
from .active_set import ActiveSetSolver
from .law_models import TangentAtRest


def contact_dofs(system: System) -> Integers:
    """Scalar dofs (local, owned, sorted) of normal displacements with contact bounds."""
    normal = (b.component()[0] for b in system.bounds)
    return np.unique(np.concatenate([np.empty(0, np.int64), *normal]))


def held_dofs(system: System, laws: Sequence[Superpotential]) -> Entities:
    """Scalar dofs (local, owned, sorted) that the resting start holds. Collective.

    These are normal displacements of contact parts; where they leave a rigid motion, also slips at which a law has a
    convex kink.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
    """
    dofs = [contact_dofs(system)]
    loose = existence.moves_with_contact_closed(system.problem)
    for term, law in zip(system.terms, laws, strict=True):
        if loose and np.any(law.convex.kinks == 0.0):
            touched = np.any(term.directions != 0, axis=1)
            dofs.append(term.surface.dofs[touched])
    return np.setdiff1d(np.concatenate(dofs), system.problem.fixed).astype(np.int32)


def resting_start(
    solver: ActiveSetSolver, laws: Sequence[Superpotential], rtol: float | None = None
) -> tuple[PETSc.Vec, int]:
    """Contact closed, laws at rest: one linear solve in which no rigid motion is free. Collective.

    From u = 0 no vertex counts as active, the reduced matrix is singular and the first step is 1e9;
    the reactions of this start give the active set instead.

    Args:
        solver: of the linear solve.
        laws: what is solved, by term.
        rtol: relative tolerance of the linear solve; by default that of a start.

    Returns:
        The displacement, and iterations of the linear solver.
    """
    rtol = solver.thresholds.start_tolerance if rtol is None else rtol
    system = solver.system
    x = system.load.duplicate()
    x.set(0.0)
    low, high = system.lower.array_r, system.upper.array_r
    contact = contact_dofs(system)
    x.array[contact] = closed(low[contact], high[contact])
    system.prescribe(x)
    held, models = held_dofs(system, laws), [TangentAtRest(law) for law in laws]
    linear = solver.newton_step(x, held, models, rtol).linear
    if _push_onto_bounds(solver, x, contact, models):
        linear += solver.newton_step(x, held, models, rtol).linear
    return x, linear


def _push_onto_bounds(solver: ActiveSetSolver, x: PETSc.Vec, contact: Integers, models: Sequence[LawModel]) -> bool:
    """Bilateral contact: move vertices between two bounds onto the one that the reaction points to. Collective.

    Nothing holds a vertex between its bounds, and the body could slide. Returns whether a vertex was moved.
    """
    system = solver.system
    residual = system.load.duplicate()
    system.residual(x, residual, models)
    low, high = system.lower.array_r[contact], system.upper.array_r[contact]
    between = np.isfinite(low) & np.isfinite(high) & (low < high)
    target = np.where(residual.array_r[contact] >= 0.0, low, high)
    x.array[contact[between]] = target[between]
    residual.destroy()
    return bool(system.comm.allreduce(bool(np.any(between))))


def closed(lower: Array, upper: Array) -> Array:
    """Displacements that close contact: a single finite bound, between two bounds the point nearest to 0, else 0, (n,).

    Args:
        lower: lower bounds, (n,).
        upper: upper bounds, (n,).
    """
    both = np.isfinite(lower) & np.isfinite(upper)
    one = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper, 0.0))
    return np.where(both, np.clip(0.0, lower, upper), one)
