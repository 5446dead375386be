"""Linear solves in which some unknowns are held, at full size.

SNES VI extracts the inactive rows and columns into a matrix without block size and near-null space, and algebraic
multigrid then fails. Here the matrix keeps its full size whatever is held (solver-notes.md): one preconditioner serves
the start and every Newton step with the same active set. Algebraic multigrid and the direct solver get a copy of the
matrix in which those rows and columns are replaced by the identity; geometric multigrid gets the matrix itself, in
which they are held by their diagonals (:meth:`.Jacobian.hold`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from petsc4py import PETSc

from ..mesh import nodes
from ..runtime.cost import Timer
from ..runtime.mpi import agree
from ..typing import Array, Entities
from .factorisation import Direct, FactorForm, form_of
from .multigrid import Algebraic, Levels, MixedMultigrid, Multigrid
from .petsc_options import CHOLESKY, configure, prefix
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
        self._in, self._out = system.load.duplicate(), system.load.duplicate()

    def prepare(self, held: Entities) -> None:
        """Make it suit these held unknowns (local, owned, sorted). Collective."""
        self._wanted = held.copy()
        self.system.jacobian.hold(held if self.settings.kind in ("mg", "mixed") else held[:0])
        if all(agree(self.system.comm, self._fits(held))):
            return
        self._held = None  # what fails to be made fits nothing
        with self._timer("setup"):
            if self.settings.kind != self._kind or self._preconditioner is None:
                self.destroy()
                self._preconditioner, self._kind = self._new(), self.settings.kind
            self._preconditioner.prepare(held)
        self._held, self._rates = held.copy(), self.system.jacobian.rates
        self._first_iterations, self._outdated = 0, False

    def _fits(self, held: Entities) -> bool:
        if self._held is None or self._outdated:
            return False
        changed, drift = len(np.setxor1d(held, self._held, assume_unique=True)), self.system.jacobian.drift(self._rates)
        if self.settings.kind in ("lu", "mixed"):
            return changed == 0 and drift == 0.0
        thresholds = self.system.thresholds
        most = 0 if self.settings.kind == "mg" else max(2, thresholds.drift * len(held))
        return changed <= most and drift <= thresholds.drift

    def report(self, iterations: int, *, failed: bool = False) -> None:
        """Report how a solve went: where iterations grow or it fails, the preconditioner is outdated.

        A direct solver takes over on small systems where a solve is slow.

        Args:
            iterations: of the solve, the same on all ranks.
            failed: whether it broke down.
        """
        thresholds = self.system.thresholds
        self._first_iterations = self._first_iterations or iterations
        self._outdated = failed or iterations > 2 * self._first_iterations
        if (failed or iterations > thresholds.slow) and self.settings.replaceable:
            self.settings, self._outdated = LinearSettings("lu"), True

    @property
    def pc(self) -> PETSc.PC:
        """The preconditioner as it is prepared."""
        assert self._preconditioner is not None
        return self._preconditioner.pc

    @property
    def inner_iterations(self) -> int:
        """Iterations so far of the solves that one application of the preconditioner consists of."""
        return self._preconditioner.iterations if isinstance(self._preconditioner, MixedMultigrid) else 0

    def _new(self) -> Preconditioner:
        if self.settings.kind == "mg":
            return Multigrid(self.system, self.levels, self.settings.pc)
        if self.settings.kind == "mixed":
            return MixedMultigrid(self.system, self.levels, self.settings.pc)
        if self.settings.kind == "gamg":
            return Algebraic(self.system, self.settings.pc)
        self._form = form_of(self.system)
        return Direct(self._form, self.settings.pc)

    def destroy(self) -> None:
        """Free the PETSc objects. Collective."""
        for thing in (self._preconditioner, self._form):
            if thing is not None:
                thing.free()
        self._preconditioner = self._form = self._held = None

    def solve_with(self, held: Entities, load: PETSc.Vec, rtol: float) -> tuple[PETSc.Vec, int, int]:
        """The solution in which some unknowns are zero, iterations, and PETSc's reason for the end. Collective.

        Args:
            held: these unknowns (local, owned).
            load: the right-hand side; changed there.
            rtol: relative tolerance of the residual's norm.
        """
        self.prepare(held)
        load.array[held] = 0.0
        x = load.duplicate()
        x.set(0.0)
        iterations, reason = self.solve(load, x, rtol)
        x.array[held] = 0.0  # multigrid leaves rounding there, and a vertex must stay exactly on its bound
        return x, iterations, reason

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
        free = inactive.getIndices() - self.system.load.owner_range[0]
        self._in.set(0.0)
        self._in.array[free] = load.array_r
        ended = self.solve(self._in, self._out, rtol)
        x.array[:] = self._out.array_r[free]
        return ended

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
        ksp, settings, thresholds = PETSc.KSP().create(self.system.comm), self.settings, self.system.thresholds
        ksp.setOperators(self._preconditioner.matrix)
        ksp.setPC(self._preconditioner.pc)
        if isinstance(self._preconditioner, MixedMultigrid):
            self._preconditioner.accuracy = min(rtol, thresholds.mixed_accuracy)
        given_up = settings.replaceable or settings.kind == "mixed"
        most = 2 * thresholds.slow if given_up else thresholds.krylov_iterations
        ksp.setTolerances(rtol=rtol, max_it=most)
        configure(ksp, settings.ksp(ksp.getPC()))
        if settings.kind in ("gamg", "mg"):
            held, whole, inner = np.union1d(self._wanted, self.system.pins), self.system.jacobian.matrix, self.pc
            matrix = PETSc.Mat().createPython(whole.getSizes(), _Unheld(whole, whole.mult, held), comm=whole.comm)
            matrix.setUp()
            pc = PETSc.PC().create(whole.comm)
            pc.setType(PETSc.PC.Type.PYTHON)
            pc.setPythonContext(_Unheld(inner, inner.apply, held))
            ksp.setPC(pc)
            ksp.setOperators(matrix)
        return ksp


class _Unheld:
    """The context of a matrix or a PC: what another one gives, and zero at held unknowns."""

    def __init__(self, of: PETSc.Mat | PETSc.PC, act: Callable[[PETSc.Vec, PETSc.Vec], None], held: Entities) -> None:
        self._of, self._act, self._held = of, act, held

    def mult(self, _: PETSc.Mat | PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Write what it gives for x to y. Collective."""
        self._act(x, y)
        y.array[self._held] = 0.0

    apply = mult

    def view(self, _: PETSc.Mat | PETSc.PC, viewer: PETSc.Viewer) -> None:
        """Show the other one."""
        self._of.view(viewer)


Kind = Literal["lu", "gamg", "mg", "mixed"]
_GAMG: dict[str, object] = {
    "pc_type": "gamg",
    "pc_gamg_threshold": 0.01,
    "mg_levels_ksp_type": "chebyshev",
    "mg_levels_pc_type": "jacobi",
    "pc_gamg_coarse_eq_limit": 200,
}
_MG: dict[str, object] = {
    "pc_type": "mg",
    "mg_levels_ksp_type": "richardson",
    "mg_levels_ksp_max_it": 1,
    "mg_levels_ksp_norm_type": "none",
    "mg_levels_pc_type": "sor",
    "mg_levels_pc_sor_local_symmetric": None,
    "mg_coarse_ksp_type": "preonly",
    "mg_coarse_pc_type": "telescope",
    "mg_coarse_telescope_ksp_type": "preonly",
    "mg_coarse_telescope_pc_type": "lu",
}
_EXACT = (PETSc.PC.Type.CHOLESKY, PETSc.PC.Type.LU, PETSc.PC.Type.PYTHON)
"""Types of a direct solver; the last is one of ours, which applies factors."""
_OF_OTHER_NORM = ("minres", "symmlq")
"""Methods that end by the norm of the preconditioned residual; PETSc refuses that of the residual itself."""


@dataclass(frozen=True, slots=True)
class LinearSettings:
    """How linear systems are solved.

    Attributes:
        kind: a factorisation (lu), algebraic multigrid (gamg), geometric multigrid (mg), or that with averaged
            pressures as unknowns (mixed).
        replaceable: whether the system is small enough for a direct solver to take over.
    """

    kind: Kind
    replaceable: bool = False

    @classmethod
    def choose(
        cls,
        system: System,
        wanted: Literal["auto", "lu", "gamg"] = "auto",
        *,
        levels: bool = False,
    ) -> LinearSettings:
        """The solver that suits the number of unknowns, and nearly incompressible bodies.

        Args:
            system: the system to be solved.
            wanted: what the user wants.
            levels: whether the system has coarser levels when it is solved.
        """
        thresholds = system.thresholds
        small = thresholds.is_direct(system.dofs, system.problem.dimension)
        if wanted != "auto":
            return cls(wanted, small)
        stiff, degree = system.problem.bulk.volumetric_ratio, nodes.degree(system.problem.space)
        if levels and system.free_motions is None:
            if stiff <= thresholds.volumetric_ratio:
                return cls("mg", small)
            if degree > 1:
                return cls("mixed")
        if stiff > 0.0:
            return cls("lu")
        return cls("lu" if small else "gamg")

    def ksp(self, pc: PETSc.PC) -> dict[str, str]:
        """Default options of the Krylov method.

        Args:
            pc: the preconditioner; in the place of a factorisation the user may have chosen another one.
        """
        if self.kind == "lu" and pc.getType() in _EXACT:
            return {"ksp_type": "preonly"}
        # where a start is already a solution, PETSc's flexible CG (fcg) is freed without having been set up, and fails
        method = "fgmres" if self.kind == "mixed" else "cg"
        if PETSc.Options().getString(f"{prefix()}ksp_type", method) in _OF_OTHER_NORM:
            return {"ksp_type": method}
        return {"ksp_type": method, "ksp_norm_type": "unpreconditioned"}

    @property
    def pc(self) -> Mapping[str, object]:
        """Default options of the preconditioner."""
        return {"lu": CHOLESKY, "gamg": _GAMG, "mg": _MG, "mixed": _MG}[self.kind]
