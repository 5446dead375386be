"""The resting start: contact closed, and laws at rest, or where they hold the motions that closed contact leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..laws import Superpotential
from ..rigid import OneSidedSupports, RestingPosition, least_energy
from ..rigid.motions import DEFAULT as RIGID
from ..runtime.mpi import agree
from ..system import existence, rigid_motions
from ..system.equations import Cells, VertexModel
from ..system.system import System
from ..typing import Array, Entities, Integers
from .active_set import ActiveSetSolver


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
    system = solver.system
    rtol = system.thresholds.loose if rtol is None else rtol
    contact = contact_dofs(system)
    bodies = system.problem.bodies.labels[contact // system.problem.dimension]
    closing = contact[system.references.driven[bodies]]
    x = system.undisplaced()
    x.array[closing] = closed(system.lower.array_r[closing], system.upper.array_r[closing])
    if moves := motions(system, contact_closed=True):
        settle(system, laws, x, moves)
        held, models = _held(system, laws, x, contact), unbroken(system, laws, x)
    else:
        held = np.setdiff1d(contact, system.problem.fixed).astype(np.int32)
        models = [
            VertexModel(law, xi=law.concave.left(np.zeros_like(term.weights)))
            for term, law in zip(system.terms, laws, strict=True)
        ]
    linear = solver.newton_step(x, held, models, rtol).linear
    if _push_onto_bounds(solver, x, closing, models):
        linear += solver.newton_step(x, held, models, rtol).linear
    return x, linear


def _held(system: System, laws: Sequence[Superpotential], x: PETSc.Vec, bearing: Integers) -> Entities:
    """The unknowns that a linear solve holds: those that bear the load, and those at kinks, where x is put exactly."""
    return np.setdiff1d(np.union1d(bearing, at_kinks(system, laws, x)), system.problem.fixed).astype(np.int32)


def _push_onto_bounds(solver: ActiveSetSolver, x: PETSc.Vec, contact: Integers, models: Sequence[VertexModel]) -> bool:
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


def at_rest(solver: ActiveSetSolver, laws: Sequence[Superpotential]) -> tuple[PETSc.Vec, int] | None:
    """The displacement of bodies at rest on their supports, and iterations of the linear solver. Collective.

    Args:
        solver: of the linear solve.
        laws: what is solved, by term.

    Returns:
        None where nothing holds the bodies, or no rigid motion is left.
    """
    system = solver.system
    x, moves = system.undisplaced(), motions(system, contact_closed=False)
    bearing = _rest(system, laws, x, moves) if moves else None
    if bearing is None:
        return None
    held = _held(system, laws, x, bearing)
    models = unbroken(system, laws, x)
    return x, solver.newton_step(x, held, models, system.thresholds.coarse_tolerance).linear


def _rest(system: System, laws: Sequence[Superpotential], x: PETSc.Vec, moves: Sequence[PETSc.Vec]) -> Integers | None:
    """Move x rigidly to rest, and return the owned unknowns that bear the load: exactly on their bounds. Collective."""
    dofs = contact_dofs(system)
    low, high = (v.array_r[dofs] - x.array_r[dofs] for v in (system.lower, system.upper))
    upper, lower = np.isfinite(high), np.isfinite(low)
    rows = np.column_stack([move.array_r[dofs] for move in moves])
    sides = np.vstack([rows[upper], -rows[lower]]), np.r_[high[upper], -low[lower]]
    mine = np.r_[dofs[upper], dofs[lower]], np.r_[system.upper.array_r[dofs][upper], system.lower.array_r[dofs][lower]]
    every = agree(system.comm, sides)
    whole = OneSidedSupports(np.concatenate([s[0] for s in every]), np.concatenate([s[1] for s in every]))
    found = settle(system, laws, x, moves, whole)
    if found is None:
        return None
    here = found.bearing - sum(len(s[1]) for s in every[: system.comm.rank])
    here = here[(here >= 0) & (here < len(mine[0]))]
    x.array[mine[0][here]] = mine[1][here]
    return np.unique(mine[0][here])


def motions(system: System, *, contact_closed: bool) -> list[PETSc.Vec]:
    """The rigid motions of all bodies that prescribed displacements leave, without those that are free. Collective.

    Args:
        system: the assembled problem.
        contact_closed: only those that do not move the contact parts in their normal direction.
    """
    free = system.free_motions.modes if system.free_motions else ()
    modes = existence.motions(system.problem, contact_closed=contact_closed, without=free)
    return [system.unknowns(field) for field in rigid_motions.fields(system.problem, modes)]


def unbroken(system: System, laws: Sequence[Superpotential], x: PETSc.Vec) -> list[VertexModel]:
    """What takes the place of the laws in the elastic step from a rigid position: their secants, unbroken, by term.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        x: the rigid position; each vertex is in the cell that holds it.
    """
    found = []
    for term, law in zip(system.terms, laws, strict=True):
        a = term.argument(x.array_r)
        cells = Cells.around(law.convex, a, radial=term.radial)
        found.append(VertexModel(law, cells, law.concave.left(np.zeros_like(a)), law.length_scale))
    return found


def _law_energy(
    system: System, laws: Sequence[Superpotential], x: PETSc.Vec, moves: Sequence[PETSc.Vec]
) -> Callable[[Array], tuple[Array, Array]]:
    """The energies of unbroken laws over rigid motions of a displacement, and subgradients, for least_energy."""
    slips = [(t.slip(x.array_r), np.stack([t.slip(m.array_r) for m in moves], axis=-1)) for t in system.terms]

    def energy(amplitudes: Array) -> tuple[Array, Array]:
        found = np.zeros((len(slips), 1 + len(moves)))
        for row, term, law, (still, moved) in zip(found, system.terms, laws, slips, strict=True):
            slip = still + moved @ amplitudes
            argument = term.argument_of(slip)
            xi = law.concave.left(np.zeros_like(argument))
            force = (term.weights * (law.convex.right(argument) - xi))[:, None] * term.gradient(slip)
            row[0] = term.energy_weights @ (law.convex.value(argument) - xi * argument)
            row[1:] = np.einsum("mr,mrk->k", force, moved)
        system.comm.Allreduce(MPI.IN_PLACE, found)
        return found[:, 0], found[:, 1:]

    return energy


def settle(
    system: System,
    laws: Sequence[Superpotential],
    x: PETSc.Vec,
    moves: Sequence[PETSc.Vec],
    sides: OneSidedSupports | None = None,
) -> RestingPosition | None:
    """Move x rigidly to where the energy of unbroken laws is least. Collective.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        x: the displacement, changed in place.
        moves: the rigid motions.
        sides: what contact leaves of their amplitudes; by default all.

    Returns:
        The position, or None where nothing stops the bodies; x is then as it was.
    """
    work = np.array([-float(system.load.dot(move)) for move in moves])
    sides = OneSidedSupports(np.zeros((0, len(moves))), np.zeros(0)) if sides is None else sides
    found = least_energy(system.comm, work, _law_energy(system, laws, x, moves), sides)
    if found is not None:
        for amplitude, move in zip(found.amplitudes, moves, strict=True):
            x.axpy(float(amplitude), move)
    return found


def at_kinks(system: System, laws: Sequence[Superpotential], x: PETSc.Vec) -> Integers:
    """Scalar dofs (local, owned) of slips at a convex kink of their law, and x put exactly there.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        x: the displacement, changed in place.
    """
    found, near = [np.empty(0, np.int64)], RIGID.touching
    for term, law in zip(system.terms, laws, strict=True):
        argument, kinks = term.argument(x.array_r), law.convex.kinks
        if not len(kinks):
            continue
        nearest = kinks[np.argmin(np.abs(argument[:, None] - kinks), axis=1)]
        on = np.abs(argument - nearest) <= near * np.maximum(1.0 / term.stretch, np.abs(nearest))
        kept = term.counts(x.array_r, near)
        touched = np.any((term.directions != 0.0) & kept[:, :, None], axis=1) & (term.free > 0) & on[:, None]
        along = np.einsum("md,m->md", np.sum(term.directions, axis=1), nearest * term.stretch)
        x.array[term.surface.dofs[touched]] = along[touched]
        found.append(term.surface.dofs[touched])
    return np.unique(np.concatenate(found))
