"""Linear solves in which some dofs are held, at full size.

SNES VI extracts the inactive rows and columns into a matrix without block size and near-null space, and algebraic
multigrid then fails. Here the full size is kept, whatever is held (solver-notes.md): one preconditioner serves the
start and every Newton step with the same active set. Algebraic multigrid and the direct solver get a copy of the
matrix with those rows and columns replaced by the identity; geometric multigrid gets the matrix itself, in which they
are held by their diagonals (:meth:`.Jacobian.hold`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..runtime.timing import Timer
from ..typing import Array, Entities
from . import multigrid, schur
from .copied_matrix import CopiedMatrix
from .levels import Levels
from .petsc_options import PREFIX, configure
from .system import System
from .thresholds import DEFAULT, Thresholds

Kind = Literal["lu", "gamg", "mg"]
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
    "mg_coarse_pc_type": "redundant",
}
_LU: dict[str, object] = {"pc_type": "cholesky", "pc_factor_mat_solver_type": "mumps"}


@dataclass(frozen=True, slots=True)
class LinearSettings:
    """How linear systems are solved.

    Attributes:
        kind: a factorisation, algebraic or geometric multigrid.
        thresholds: when that is left for another one, and when it is set up anew.
    """

    kind: Kind
    thresholds: Thresholds = DEFAULT

    @classmethod
    def choose(
        cls,
        system: System,
        wanted: Literal["auto", "lu", "gamg"] = "auto",
        thresholds: Thresholds = DEFAULT,
        *,
        levels: bool = False,
    ) -> LinearSettings:
        """By the number of unknowns, unless the user wants one; a nearly incompressible body goes to the direct one.

        Args:
            system: to be solved.
            wanted: by the user.
            thresholds: up to which size which one is used.
            levels: whether the system has coarser levels when it is solved.
        """
        if wanted != "auto":
            return cls(wanted, thresholds)
        if system.problem.bulk.averages_dilatation:
            return cls("lu", thresholds)
        if levels and system.freedom is None:
            return cls("mg", thresholds)
        return cls("lu" if _small(system, thresholds) else "gamg", thresholds)

    @property
    def ksp(self) -> dict[str, str]:
        """The Krylov method that goes with it."""
        return {"ksp_type": "preonly"} if self.kind == "lu" else {"ksp_type": "cg", "ksp_norm_type": "unpreconditioned"}

    @property
    def pc(self) -> dict[str, object]:
        """The preconditioner's options."""
        return {"lu": _LU, "gamg": _GAMG, "mg": _MG}[self.kind]


def _small(system: System, thresholds: Thresholds) -> bool:
    return system.dofs <= thresholds.largest_direct[system.problem.scales.dimension]


class Preconditioner(Protocol):
    """A preconditioner that can be prepared for other held unknowns.

    Attributes:
        pc: PETSc's object.
        matrix: what it preconditions, and equations are to be solved with.
    """

    pc: PETSc.PC
    matrix: PETSc.Mat

    def prepare(self, held: Entities) -> None:
        """Fit it to the system's matrix as it stands with these unknowns held. Collective."""

    def free(self) -> None:
        """Free the PETSc objects."""


class HeldPreconditioner:
    """The preconditioner of the system's matrix with some dofs held; set up anew only when it has to be.

    A direct solve wants the very matrix. A Krylov method is content with that of a similar active set and tangent, as
    long as its iterations do not grow.

    Args:
        system: whose matrix it is.
        levels: its coarser levels; used by geometric multigrid alone.
        settings: how linear systems are solved.
        timer: where time goes.
    """

    def __init__(self, system: System, levels: Levels, settings: LinearSettings, timer: Timer) -> None:
        self.system, self.levels, self.settings, self._timer = system, levels, settings, timer
        self._held: Entities | None = None
        self._rates: list[Array] = []
        self._first_iterations, self._outdated = 0, False
        self._preconditioner: Preconditioner | None = None
        self._kind: Kind | None = None
        self._factorised = 0
        self._in, self._out = system.load.duplicate(), system.load.duplicate()
        self._runs: list[tuple[slice, slice]] = []

    def prepare(self, held: Entities) -> None:
        """Make it fit for these held dofs (local, owned, sorted). Collective."""
        self.system.jacobian.hold(held if self.settings.kind == "mg" else held[:0])
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
        if self.settings.kind == "lu":
            return changed == 0 and drift == 0.0
        most = 0 if self.settings.kind == "mg" else max(2, 0.1 * len(held))
        return changed <= most and drift <= self.settings.thresholds.drift

    def report(self, iterations: int) -> None:
        """Tell what a solve took (the same on all ranks): a preconditioner that serves badly is not used again."""
        self._first_iterations = self._first_iterations or iterations
        self._outdated = iterations > 1.5 * self._first_iterations + 5
        thresholds = self.settings.thresholds
        if iterations > thresholds.slow and _small(self.system, thresholds):
            self.settings, self._outdated = LinearSettings("lu", thresholds), True

    def _build(self, held: Entities) -> None:
        kind, worth = self.settings.kind, self._factorised * self.settings.thresholds.condensing
        condensing = kind == "lu" and schur.pays(self.system, worth)
        if kind != self._kind or self._preconditioner is None or (condensing and not self._condensed):
            self._forget()
            self._preconditioner, self._kind = self._new(condensing=condensing), kind
        self._preconditioner.prepare(held)
        self._factorised += 1

    @property
    def _condensed(self) -> bool:
        return isinstance(self._preconditioner, schur.SchurDirect)

    def _new(self, *, condensing: bool) -> Preconditioner:
        """Condensing: the body's own factorisation, made once, serves a matrix that changes on Γc alone."""
        if condensing:
            return schur.SchurDirect(self.system, self.settings.pc)
        if self.settings.kind == "mg":
            return multigrid.Multigrid(self.system, self.levels, self.settings.pc)
        return CopiedMatrix(self.system, self.settings.pc, direct=self.settings.kind == "lu")

    def destroy(self) -> None:
        """Free the PETSc objects."""
        self._forget()

    def _forget(self) -> None:
        if self._preconditioner is not None:
            self._preconditioner.free()
        self._preconditioner = self._held = None

    def select(self, inactive: PETSc.IS) -> None:
        """Reduced vectors hold these dofs from now on."""
        self._runs = list(runs(inactive.getIndices() - self.system.load.owner_range[0]))
        self._in.set(0.0)

    def multiply_reduced(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Y = J x on the selected dofs, all others being zero. Collective."""
        self._reduced(self.system.jacobian.matrix.mult, x, y)

    def apply_reduced(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Y = P^-1 x on the selected dofs. Collective."""
        self._reduced(self._unpinned, x, y)

    def _unpinned(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        x.array[self.system.pins] = 0.0
        self._preconditioner.pc.apply(x, y)  # type: ignore[union-attr]

    def _reduced(self, operation: Callable[[PETSc.Vec, PETSc.Vec], None], x: PETSc.Vec, y: PETSc.Vec) -> None:
        whole, part = self._in.array, x.array_r
        for at, of in self._runs:
            whole[at] = part[of]
        operation(self._in, self._out)
        whole, part = self._out.array_r, y.array
        for at, of in self._runs:
            part[of] = whole[at]

    def solve(self, load: PETSc.Vec, x: PETSc.Vec, rtol: float) -> tuple[int, int]:
        """Solve with the held matrix, from the guess in x; iterations and PETSc's reason. Collective.

        Where motions are free, the load may be changed at pinned dofs, and of all solutions x is the shortest.
        """
        load.array[self.system.pins] = 0.0
        ksp = PETSc.KSP().create(self.system.comm)
        assert self._preconditioner is not None
        ksp.setOperators(self._preconditioner.matrix)
        ksp.setPC(self._preconditioner.pc)
        ksp.setTolerances(rtol=rtol, max_it=2000)
        ksp.setInitialGuessNonzero(self.settings.kind != "lu")
        configure(ksp, self.settings.ksp, PREFIX)
        with self._timer("solve"):
            ksp.solve(load, x)
        if self.system.freedom is not None:
            self.system.freedom.null_space.remove(x)
        result = int(ksp.getIterationNumber()), int(ksp.getConvergedReason())
        ksp.destroy()
        self.report(result[0])
        return result


def runs(chosen: Entities) -> Iterator[tuple[slice, slice]]:
    """Runs of consecutive dofs, in the whole vector and in the reduced one: copied far faster than dof by dof."""
    breaks = np.flatnonzero(np.diff(chosen) != 1) + 1
    for run in np.split(np.arange(len(chosen)), breaks) if len(chosen) else []:
        begin, end = int(run[0]), int(run[-1]) + 1
        yield slice(int(chosen[begin]), int(chosen[end - 1]) + 1), slice(begin, end)
