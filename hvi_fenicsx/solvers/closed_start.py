"""The resting start: contact closed, and laws at rest, or where they hold the motions that closed contact leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from ..laws import Superpotential
from ..system.law_model import LawModel
from ..system.system import System
from ..typing import Array, Integers
from . import rigid_position
from .active_set import ActiveSetSolver
from .law_models import TangentAtRest


def contact_dofs(system: System) -> Integers:
    """Scalar dofs (local, owned, sorted) of normal displacements with contact bounds."""
    normal = (b.component()[0] for b in system.bounds)
    return np.unique(np.concatenate([np.empty(0, np.int64), *normal]))


def resting_start(
    solver: ActiveSetSolver, laws: Sequence[Superpotential], rtol: float | None = None
) -> tuple[PETSc.Vec, int]:
    """Contact closed, laws at rest: one linear solve in which no rigid motion is free. Collective.

    From u = 0 no vertex counts as active, the reduced matrix is singular and the first step is 1e9; the reactions of
    this start give the active set instead. What closed contact leaves free, the laws hold, and they may do so only far
    from rest (a dead zone, a support at a distance): there the bodies are moved first. A body that nothing drives
    remains where it is: it need not travel to its supports.

    Args:
        solver: of the linear solve.
        laws: what is solved, by term.
        rtol: relative tolerance of the linear solve; by default that of a start.

    Returns:
        The displacement, and iterations of the linear solver.
    """
    rtol = solver.thresholds.start_tolerance if rtol is None else rtol
    system = solver.system
    contact = contact_dofs(system)
    bodies = system.problem.bodies.labels[contact // system.problem.scales.dimension]
    closing = contact[system.references.driven[bodies]]
    x = _closed_contact(system, closing)
    models, kinks = _held_by_laws(solver, laws, x)
    held = np.setdiff1d(np.union1d(contact, kinks), system.problem.fixed).astype(np.int32)
    linear = solver.newton_step(x, held, models, rtol).linear
    if _push_onto_bounds(solver, x, closing, models):
        linear += solver.newton_step(x, held, models, rtol).linear
    return x, linear


def _held_by_laws(
    solver: ActiveSetSolver, laws: Sequence[Superpotential], x: PETSc.Vec
) -> tuple[Sequence[LawModel], Integers]:
    """Move x to where the laws hold what closed contact leaves free. Collective.

    Returns:
        What takes the place of the laws in the elastic step from there, by term, and the scalar dofs (local, owned) of
        slips at convex kinks.
    """
    system, at_rest = solver.system, [TangentAtRest(law) for law in laws]
    moves = rigid_position.motions(system, contact_closed=True)
    if not moves:
        return at_rest, np.empty(0, np.int64)
    settled = rigid_position.settle(system, laws, x, moves) is not None
    kinks = rigid_position.at_kinks(system, laws, x, solver.thresholds.touching)
    return rigid_position.models(solver, laws, x) if settled else at_rest, kinks


def _closed_contact(system: System, contact: Integers) -> PETSc.Vec:
    """A new x: some contact closed, the prescribed values, and zero elsewhere. Collective."""
    x = system.load.duplicate()
    x.set(0.0)
    low, high = system.lower.array_r, system.upper.array_r
    x.array[contact] = closed(low[contact], high[contact])
    system.prescribe(x)
    return x


def _push_onto_bounds(solver: ActiveSetSolver, x: PETSc.Vec, contact: Integers, models: Sequence[LawModel]) -> bool:
    """Bilateral contact: move vertices between two bounds onto the one that the reaction points to. Collective.

    Nothing holds a vertex between its bounds, and the body could slide. Returns whether a vertex was moved.
    """
    system = solver.system
    residual = system.load.duplicate()
    system.equations.residual(x, residual, models)
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
