"""What every method shares: its settings, its result, and the start that holds the rigid motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..laws import Superpotential
from ..system import existence
from ..system.system import Model, System
from ..typing import Array, Entities, Integers
from .active_set import ActiveSetSolver, Outcome
from .initial_branches import Start
from .law_models import Resting

Progress = Callable[[str, float | None, int, float, int], None]
"""Called with the stage's name, ε, iteration, residual and vertices in contact."""
_START = 1e-2
"""Relative, of a start's linear solve: what its active set needs, and laws that do not rest make it no better."""


def silent(stage: str, epsilon: float | None, iteration: int, residual: float, contact: int) -> None:
    """A progress display that shows nothing."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a method is told.

    Attributes:
        tolerance: of the residual of the inequality, relative. max_branches: convex steps of the branch iteration.
        max_newton: Newton steps of one solve. epsilon: relative width of the laws' smoothing, None for exact laws.
        start: the pieces of the laws that the branch iteration begins on.
        steady: whether the pieces and the active set of a start from the rung below are expected to stand.
    """

    tolerance: float = 1e-8
    max_branches: int = 200
    max_newton: int = 60
    epsilon: float | None = None
    progress: Progress = silent
    start: Start = "unbroken"
    steady: bool = False


@dataclass
class Counts:
    """Iterations spent."""

    newton: int = 0
    linear: int = 0
    branch: int = 0

    def spend(self, step: Outcome) -> None:
        """Count one solve of the solver's in."""
        self.newton += step.newton
        self.linear += step.linear

    def add(self, other: Counts) -> None:
        """Count another method's in."""
        self.newton += other.newton
        self.linear += other.linear
        self.branch += other.branch


@dataclass(frozen=True)
class SolveResult:
    """What a method found.

    Attributes:
        u: the displacement in units of u0, ghosts updated. method: its name. converged: by the method's own test.
        reason: in words. counts: iterations. energies: after each convex step, nondimensional.
        interrupted: whether it ended because it was told to. levels: rungs of the ladder that it went up.
        steady: whether the pieces and the active set that it began with stood, on every rung of the ladder.
    """

    u: fem.Function
    method: str
    converged: bool
    reason: str
    counts: Counts = field(default_factory=Counts)
    energies: tuple[float, ...] = ()
    interrupted: bool = False
    levels: int = 1
    steady: bool = False


def contact_dofs(system: System) -> Integers:
    """Scalar dofs (local, owned, sorted) of the normal displacements that have bounds."""
    normal = (b.component()[0] for b in system.bounds)
    return np.unique(np.concatenate([np.empty(0, np.int64), *normal]))


def held_dofs(system: System, laws: Sequence[Superpotential]) -> Entities:
    """Scalar dofs (local, owned, sorted) that the start holds. Collective.

    The normal ones of contact parts; where these leave a rigid motion, also slips at which a law has a convex kink.
    """
    dofs = [contact_dofs(system)]
    loose = existence.moves_with_contact_closed(system.problem)
    for term, law in zip(system.terms, laws, strict=True):
        if loose and np.any(law.convex.kinks == 0.0):
            touched = np.any(term.directions != 0, axis=1)
            dofs.append(term.surface.dofs[touched])
    return np.setdiff1d(np.concatenate(dofs), system.problem.fixed).astype(np.int32)


def resting_start(
    solver: ActiveSetSolver, laws: Sequence[Superpotential], rtol: float = _START
) -> tuple[PETSc.Vec, int]:
    """Contact closed, laws at rest: one linear solve in which no rigid motion is free. Collective.

    From u = 0 no vertex counts as active, the reduced matrix is singular and the first step is 1e9 (solver-notes.md);
    the reactions of this start give the active set instead.
    """
    system = solver.system
    x = system.load.duplicate()
    x.set(0.0)
    low, high = system.lower.array_r, system.upper.array_r
    contact = contact_dofs(system)
    x.array[contact] = closed(low[contact], high[contact])
    system.prescribe(x)
    held, models = held_dofs(system, laws), [Resting(law) for law in laws]
    linear = solver.newton_step(x, held, models, rtol).linear
    if _pushed(solver, x, contact, models):
        linear += solver.newton_step(x, held, models, rtol).linear
    return x, linear


def _pushed(solver: ActiveSetSolver, x: PETSc.Vec, contact: Integers, models: Sequence[Model]) -> bool:
    """Bilateral contact: put vertices between their bounds on the one that the reaction points to. Collective.

    Between its bounds a vertex is held by nothing, and the body could drift. Whether any vertex was moved.
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
    """The bound to close on: the only finite one, or of two the point nearest 0; 0 where there is none."""
    both = np.isfinite(lower) & np.isfinite(upper)
    one = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper, 0.0))
    return np.where(both, np.clip(0.0, lower, upper), one)
