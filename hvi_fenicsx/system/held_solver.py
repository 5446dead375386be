"""Linear solves in which some unknowns are held, at full size.

SNES VI extracts the inactive rows and columns into a matrix without block size and near-null space, and algebraic
multigrid then fails. Here the matrix keeps its full size whatever is held (solver-notes.md): one preconditioner serves
the start and every Newton step with the same active set. Algebraic multigrid and the direct solver get a copy of the
matrix in which those rows and columns are replaced by the identity; geometric multigrid gets the matrix itself, in
which they are held by their diagonals (:meth:`.Jacobian.hold`).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..runtime.cost import Timer
from ..typing import Array, Entities
from . import direct, factorisation
from .direct import Direct
from .factorisation import FactorForm, form_of
from .levels import Levels
from .linear_settings import Kind, LinearSettings
from .multigrid import Algebraic, MixedMultigrid, Multigrid
from .petsc_options import configure
from .system import System


class Preconditioner(Protocol):
    """A preconditioner that can be prepared for other held unknowns.

    Attributes:
        pc: PETSc's object.
        matrix: what it preconditions.
    """

    pc: PETSc.PC
    matrix: PETSc.Mat

    def prepare(self, held: Entities) -> None:
        """Set it up for the system's present matrix with these unknowns held. Collective."""

    def free(self) -> None:
        """Free the PETSc objects."""


class HeldPreconditioner:
    """The preconditioner of the system's matrix with some unknowns held; made anew only where it has to be.

    A direct solver needs the exact matrix. A Krylov method also converges with the preconditioner of a similar active
    set and tangent, as long as its iterations do not grow.

    Args:
        system: the system.
        levels: its coarser levels; used by geometric multigrid alone.
        settings: how linear systems are solved.
        timer: where time goes.
    """

    def __init__(self, system: System, levels: Levels, settings: LinearSettings, timer: Timer) -> None:
        self.system, self.levels, self.settings, self._timer = system, levels, settings, timer
        self._held: Entities | None = None
        self._wanted: Entities = np.empty(0, np.int32)  # those held now; the preconditioner may be of others
        self._rates: list[Array] = []
        self._first_iterations, self._outdated = 0, False
        self._preconditioner: Preconditioner | None = None
        self._form: FactorForm | None = None
        self._kind: Kind | None = None
        self._factorised = 0
        self._in, self._out = system.load.duplicate(), system.load.duplicate()
        self._runs: list[tuple[slice, slice]] = []

    def prepare(self, held: Entities) -> None:
        """Make it suit these held unknowns (local, owned, sorted). Collective."""
        self._wanted = held.copy()
        self.system.jacobian.hold(held if self.settings.kind in ("mg", "mixed") else held[:0])
        if self.system.comm.allreduce(self._fits(held), op=MPI.LAND):
            return
        with self._timer("setup"):
            self._build(held)
        self._held, self._rates = held.copy(), self.system.jacobian.rates
        self._first_iterations, self._outdated = 0, False

    def _fits(self, held: Entities) -> bool:
        if self._held is None or self._outdated:
            return False
        changed, drift = len(np.setxor1d(held, self._held, assume_unique=True)), self.system.jacobian.drift(self._rates)
        if self.settings.kind in ("lu", "mixed"):
            return changed == 0 and drift == 0.0
        thresholds = self.settings.thresholds
        most = 0 if self.settings.kind == "mg" else max(2, thresholds.drift * len(held))
        return changed <= most and drift <= thresholds.drift

    def report(self, iterations: int, *, failed: bool = False) -> None:
        """Report how a solve went: where iterations grow or it fails, the preconditioner is outdated.

        A direct solver takes over on small systems where a solve is slow, or algebraic multigrid is made too often.

        Args:
            iterations: of the solve, the same on all ranks.
            failed: whether it broke down.
        """
        thresholds = self.settings.thresholds
        self._first_iterations = self._first_iterations or iterations
        self._outdated = failed or iterations > thresholds.slower * self._first_iterations + 5
        rebuilt = self.settings.kind == "gamg" and self._factorised > thresholds.slow
        if (failed or rebuilt or iterations > thresholds.slow) and self.settings.replaceable:
            self.settings, self._outdated = LinearSettings("lu", thresholds), True

    def _build(self, held: Entities) -> None:
        kind, condensing = self.settings.kind, self._condensing
        if kind != self._kind or self._preconditioner is None or (condensing and not self._condensed):
            self._free_preconditioner()
            self._preconditioner, self._kind, self._factorised = self._new(condensing=condensing), kind, 0
        self._preconditioner.prepare(held)
        self._factorised += 1

    @property
    def inner_iterations(self) -> int:
        """Iterations so far of the solves that one application of the preconditioner consists of."""
        return self._preconditioner.iterations if isinstance(self._preconditioner, MixedMultigrid) else 0

    @property
    def _condensing(self) -> bool:
        """Whether the body is to be condensed. Collective."""
        if not isinstance(self._preconditioner, Direct):
            return self._condensed
        worth = factorisation.solves_worth(self._preconditioner.factors)
        return direct.is_worthwhile(self.system, self._factorised * worth)

    @property
    def _condensed(self) -> bool:
        return isinstance(self._preconditioner, direct.SchurDirect)

    def _new(self, *, condensing: bool) -> Preconditioner:
        """A new preconditioner; condensing, one factorisation of the body serves all matrices that differ on Γc."""
        if condensing:
            return direct.SchurDirect(self._factored_form, self.settings.pc)
        if self.settings.kind == "mg":
            return Multigrid(self.system, self.levels, self.settings.pc)
        if self.settings.kind == "mixed":
            return MixedMultigrid(self.system, self.levels, self.settings.pc)
        if self.settings.kind == "lu":
            return Direct(self._factored_form, self.settings.pc)
        return Algebraic(self.system, self.settings.pc)

    @property
    def _factored_form(self) -> FactorForm:
        """The form in which the matrix is factorised. Collective when first used."""
        if self._form is None:
            self._form = form_of(self.system)
        return self._form

    def destroy(self) -> None:
        """Free the PETSc objects. Collective."""
        self._free_preconditioner()
        if self._form is not None:
            self._form.free()
        self._form = None

    def _free_preconditioner(self) -> None:
        if self._preconditioner is not None:
            self._preconditioner.free()
        self._preconditioner = self._held = None

    def select(self, inactive: PETSc.IS) -> None:
        """Choose the dofs of which reduced vectors consist from now on."""
        self._runs = list(consecutive_runs(inactive.getIndices() - self.system.load.owner_range[0]))
        self._in.set(0.0)

    def apply_reduced(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the preconditioner, y = P^-1 x, on the selected dofs. Collective.

        Args:
            x: a reduced vector.
            y: where the result is written, reduced too.
        """
        self._spread(x)
        self._in.array[self.system.pins] = 0.0
        self._preconditioner.pc.apply(self._in, self._out)  # type: ignore[union-attr]
        self._collect(y)

    def solve_reduced(self, inactive: PETSc.IS, load: PETSc.Vec, x: PETSc.Vec, rtol: float) -> tuple[int, int]:
        """As :meth:`solve`, on the dofs that are not held. Collective.

        Args:
            inactive: these dofs.
            load: the right-hand side, a reduced vector.
            x: where the solution is written, reduced too.
            rtol: relative tolerance of the residual's norm.

        Returns:
            Iterations, and PETSc's reason for the end.
        """
        self.select(inactive)
        self._spread(load)
        ended = self.solve(self._in, self._out, rtol)
        self._collect(x)
        return ended

    def _spread(self, x: PETSc.Vec) -> None:
        """Write a reduced vector into the one at full size, in which all others are zero."""
        whole, part = self._in.array, x.array_r
        for at, of in self._runs:
            whole[at] = part[of]

    def _collect(self, y: PETSc.Vec) -> None:
        whole, part = self._out.array_r, y.array
        for at, of in self._runs:
            part[of] = whole[at]

    def solve(self, load: PETSc.Vec, x: PETSc.Vec, rtol: float) -> tuple[int, int]:
        """Solve with the matrix in which unknowns are held. Collective.

        Where motions are free, x is the shortest of all solutions.

        Args:
            load: the right-hand side; changed at pinned dofs.
            x: where the solution is written.
            rtol: relative tolerance of the residual's norm.

        Returns:
            Iterations, and PETSc's reason for the end.
        """
        self.system.free_leftovers()  # of the step before, and of who asks for this one
        load.array[self.system.pins] = 0.0
        ksp, before = self._krylov(rtol), self.inner_iterations
        with self._timer("solve"):
            ksp.solve(load, x)
        if self.system.free_motions is not None:
            self.system.free_motions.null_space.remove(x)
        iterations, reason = int(ksp.getIterationNumber()), int(ksp.getConvergedReason())
        ksp.destroy()
        self.report(iterations, failed=reason < 0)
        return iterations + self.inner_iterations - before, reason

    def _krylov(self, rtol: float) -> PETSc.KSP:
        """The Krylov method, to be destroyed after use."""
        assert self._preconditioner is not None
        ksp, settings = PETSc.KSP().create(self.system.comm), self.settings
        ksp.setOperators(self._preconditioner.matrix)
        ksp.setPC(self._preconditioner.pc)
        if isinstance(self._preconditioner, MixedMultigrid):
            self._preconditioner.accuracy = min(rtol, settings.thresholds.mixed_accuracy)
        ksp.setTolerances(rtol=rtol, max_it=settings.iterations)
        configure(ksp, settings.ksp(ksp.getPC()))
        if settings.kind in ("gamg", "mg"):
            held = np.union1d(self._wanted, self.system.pins)
            set_up(ksp, self.system.jacobian.matrix, self._preconditioner.pc, held)
        return ksp


def consecutive_runs(chosen: Entities) -> Iterator[tuple[slice, slice]]:
    """Runs of consecutive dofs, in the whole and in the reduced vector: far faster to copy than dof by dof."""
    breaks = np.flatnonzero(np.diff(chosen) != 1) + 1
    for run in np.split(np.arange(len(chosen)), breaks) if len(chosen) else []:
        begin, end = int(run[0]), int(run[-1]) + 1
        yield slice(int(chosen[begin]), int(chosen[end - 1]) + 1), slice(begin, end)


class _Matrix:
    """The context of the matrix."""

    def __init__(self, whole: PETSc.Mat, held: Entities) -> None:
        self._whole, self._held = whole, held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply y = J x. Collective."""
        self._whole.mult(x, y)
        y.array[self._held] = 0.0


class _Preconditioner:
    """The context of the PC."""

    def __init__(self, inner: PETSc.PC, held: Entities) -> None:
        self._inner, self._held = inner, held

    def apply(self, _: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the inner preconditioner. Collective."""
        self._inner.apply(x, y)
        y.array[self._held] = 0.0

    def view(self, _: PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Show the inner preconditioner."""
        self._inner.view(viewer)


def set_up(ksp: PETSc.KSP, whole: PETSc.Mat, inner: PETSc.PC, held: Entities) -> None:
    """Give a method its matrix and preconditioner, for one solve from zero. Collective.

    Args:
        ksp: the method.
        whole: J.
        inner: a preconditioner of it; one of a J with other held unknowns and another tangent will do.
        held: the unknowns that are held (local, owned).
    """
    matrix = PETSc.Mat().createPython(whole.getSizes(), _Matrix(whole, held), comm=whole.comm)
    matrix.setUp()
    pc = PETSc.PC().create(whole.comm)
    pc.setType(PETSc.PC.Type.PYTHON)
    pc.setPythonContext(_Preconditioner(inner, held))
    ksp.setPC(pc)
    ksp.setOperators(matrix)
