"""Bodies moved rigidly to where their energy is least, by the laws' own growth and within the bounds of contact.

Each law is H - ξ with ξ ∈ ∂G(0), an unbroken bond; so the energy is convex.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..laws import Superpotential
from ..problem.law_term import LawTerm
from ..rigid import Rest, Sides, least_energy
from ..system import existence, free_motions
from ..system.law_model import LawModel
from ..system.system import System
from ..typing import Array, Integers
from .active_set import ActiveSetSolver
from .law_models import Cells, Majorant, SecantMajorant


def motions(system: System, *, contact_closed: bool) -> list[PETSc.Vec]:
    """The rigid motions of all bodies that prescribed displacements leave, without those that are free. Collective.

    Args:
        system: the assembled problem.
        contact_closed: only those that do not move the contact parts in their normal direction.
    """
    free = system.free_motions.modes if system.free_motions else ()
    modes = existence.motions(system.problem, contact_closed=contact_closed, without=free)
    return [system.unknowns(field) for field in free_motions.fields(system.problem, modes)]


def models(solver: ActiveSetSolver, laws: Sequence[Superpotential], x: PETSc.Vec) -> list[LawModel]:
    """What takes the place of the laws in the elastic step from a rigid position: their secants, unbroken, by term.

    Args:
        solver: of that step.
        laws: what is solved, by term.
        x: the rigid position.
    """
    return [SecantMajorant(m, m.law.length_scale) for m in unbroken(solver.system, laws, x)]


def unbroken(system: System, laws: Sequence[Superpotential], x: PETSc.Vec) -> list[Majorant]:
    """H - ξ with unbroken bonds, by term, each vertex in the cell that holds it.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        x: the displacement.
    """
    found = []
    for term, law in zip(system.terms, laws, strict=True):
        a = term.argument(x.array_r)
        cells = Cells.around(law.convex, a, radial=term.radial)
        found.append(Majorant(law, cells, law.concave.left(np.zeros_like(a))))
    return found


class _LawEnergy:
    """The energies of unbroken laws over rigid motions of a displacement.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        x: the displacement.
        moves: the motions.
    """

    def __init__(
        self, system: System, laws: Sequence[Superpotential], x: PETSc.Vec, moves: Sequence[PETSc.Vec]
    ) -> None:
        self._comm, self._laws, self._terms, self._count = system.comm, laws, system.terms, len(moves)
        self._slips = [t.slip(x.array_r) for t in system.terms]
        self._moves = [np.stack([t.slip(m.array_r) for m in moves], axis=-1) for t in system.terms]

    def __call__(self, amplitudes: Array) -> tuple[Array, Array]:
        """Values (p,) and subgradients (p, k) at amplitudes (k,). Collective."""
        values, slopes = np.zeros(len(self._terms)), np.zeros((len(self._terms), self._count))
        for p, (term, law) in enumerate(zip(self._terms, self._laws, strict=True)):
            values[p], slopes[p] = self._of_term(term, law, p, amplitudes)
        self._comm.Allreduce(MPI.IN_PLACE, values, op=MPI.SUM)
        self._comm.Allreduce(MPI.IN_PLACE, slopes, op=MPI.SUM)
        return values, slopes

    def _of_term(self, term: LawTerm, law: Superpotential, p: int, amplitudes: Array) -> tuple[float, Array]:
        slip = self._slips[p] + self._moves[p] @ amplitudes
        argument = term.argument_of(slip)
        xi, weights = law.concave.left(np.zeros_like(argument)), term.weights
        force = (weights * (law.convex.right(argument) - xi))[:, None] * term.gradient(slip)
        energy = term.energy_weights @ (law.convex.value(argument) - xi * argument)
        return float(energy), np.einsum("mr,mrk->k", force, self._moves[p])


def settle(
    system: System, laws: Sequence[Superpotential], x: PETSc.Vec, moves: Sequence[PETSc.Vec], sides: Sides | None = None
) -> Rest | None:
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
    sides = Sides(np.zeros((0, len(moves))), np.zeros(0)) if sides is None else sides
    found = least_energy(system.comm, work, _LawEnergy(system, laws, x, moves), sides)
    if found is not None:
        for amplitude, move in zip(found.amplitudes, moves, strict=True):
            x.axpy(float(amplitude), move)
    return found


def at_kinks(system: System, laws: Sequence[Superpotential], x: PETSc.Vec, near: float) -> Integers:
    """Scalar dofs (local, owned) of slips at a convex kink of their law, and x put exactly there.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        x: the displacement, changed in place.
        near: distance (of u0) from a kink that counts as being on it.
    """
    found = [np.empty(0, np.int64)]
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
