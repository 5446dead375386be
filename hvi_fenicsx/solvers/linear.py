"""Linear solves in which some dofs are held: the full-size matrix with those rows and columns replaced by the identity.

SNES VI extracts the inactive rows and columns into a matrix without block size and near-null space, and algebraic
multigrid then fails. Here the full size is kept, whatever is held (solver-notes.md): one preconditioner serves the
start and every Newton step with the same active set.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from mpi4py import MPI
from petsc4py import PETSc

from ..system import System
from ..timing import Timer
from . import multigrid
from .options import PREFIX, configure

Indices = npt.NDArray[np.int32]
Kind = Literal["lu", "gamg", "mg"]
_LARGEST_DIRECT = {2: 60_000, 3: 15_000}
"""Unknowns up to which a direct solve is the faster one, by dimension (docs/benchmarks.md)."""
_DRIFT = 0.3
"""Change of a law's nodal stiffness, relative to an elastic one (about 1), that a Krylov method takes lightly."""
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
    """How linear systems are solved."""

    kind: Kind

    @classmethod
    def choose(cls, system: System, wanted: Literal["auto", "lu", "gamg"] = "auto") -> LinearSettings:
        """By the number of unknowns, unless the user wants one; a nearly incompressible body goes to the direct one."""
        if wanted != "auto":
            return cls(wanted)
        if system.dofs <= _LARGEST_DIRECT[system.problem.scales.dimension] or system.problem.averaged:
            return cls("lu")
        return cls("mg" if system.prolongations else "gamg")

    @property
    def ksp(self) -> dict[str, str]:
        """The Krylov method that goes with it."""
        return {"ksp_type": "preonly"} if self.kind == "lu" else {"ksp_type": "cg", "ksp_norm_type": "unpreconditioned"}

    @property
    def pc(self) -> dict[str, object]:
        """The preconditioner's options."""
        return {"lu": _LU, "gamg": _GAMG, "mg": _MG}[self.kind]


class HeldPreconditioner:
    """The preconditioner of the system's matrix with some dofs held; set up anew only when it has to be.

    A direct solve wants the very matrix. A Krylov method is content with that of a similar active set and tangent, as
    long as its iterations do not grow.
    """

    def __init__(self, system: System, settings: LinearSettings, timer: Timer) -> None:
        self.system, self.settings, self._timer = system, settings, timer
        self._held: Indices | None = None
        self._rates: list[npt.NDArray[np.float64]] = []
        self._fresh, self._worn = 0, False
        self._matrix: PETSc.Mat | None = None
        self._pc: PETSc.PC | None = None
        self._in, self._out = system.load.duplicate(), system.load.duplicate()

    def prepare(self, held: Indices) -> None:
        """Make it fit for these held dofs (local, owned, sorted). Collective."""
        if self.system.comm.allreduce(self._fits(held), op=MPI.LAND):
            return
        with self._timer("setup"):
            self._build(held)
        self._held, self._rates = held.copy(), self.system.rates
        self._fresh, self._worn = 0, False

    def _fits(self, held: Indices) -> bool:
        if self._held is None or self._worn:
            return False
        changed = len(np.setxor1d(held, self._held, assume_unique=True))
        if self.settings.kind == "lu":
            return changed == 0 and self.system.drift(self._rates) == 0.0
        return changed <= max(2, 0.1 * len(held)) and self.system.drift(self._rates) <= _DRIFT

    def report(self, iterations: int) -> None:
        """Tell what a solve took (the same on all ranks): a preconditioner that serves badly is not used again."""
        self._fresh = self._fresh or iterations
        self._worn = iterations > 1.5 * self._fresh + 5

    def _build(self, held: Indices) -> None:
        self.destroy()
        start = self.system.load.owner_range[0]
        self._matrix = self.system.matrix.copy()
        self._matrix.zeroRowsColumns((held + start).astype(PETSc.IntType), diag=1.0)
        self._matrix.setBlockSize(self.system.problem.scales.dimension)
        self._matrix.setNearNullSpace(self.system.near_null)
        self._matrix.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._matrix.setOption(PETSc.Mat.Option.SPD, self.settings.kind != "lu")
        self._pc = PETSc.PC().create(self.system.comm)
        self._pc.setOperators(self._matrix)
        if self.settings.kind == "mg":
            multigrid.hang(self._pc, self._matrix, self.system.prolongations, self._untouched(held))
        configure(self._pc, self.settings.pc)
        self._pc.setUp()

    def _untouched(self, held: Indices) -> PETSc.Vec:
        """1 for the unknowns that are neither held nor prescribed, else 0."""
        mask = self.system.load.duplicate()
        mask.set(1.0)
        fixed = self.system.problem.fixed
        mask.array[held] = 0.0
        mask.array[fixed[fixed < mask.local_size]] = 0.0
        return mask

    def destroy(self) -> None:
        """Free the PETSc objects."""
        for thing in (self._matrix, self._pc):
            if thing is not None:
                thing.destroy()
        self._matrix = self._pc = None
        self._held = None

    def apply_full(self, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Y = P^-1 x, full size. Collective."""
        self._pc.apply(x, y)  # type: ignore[union-attr]

    def apply_reduced(self, inactive: PETSc.IS, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """The same for vectors that hold the inactive dofs only. Collective."""
        self._in.set(0.0)
        part = self._in.getSubVector(inactive)
        x.copy(part)
        self._in.restoreSubVector(inactive, part)
        self.apply_full(self._in, self._out)
        part = self._out.getSubVector(inactive)
        part.copy(y)
        self._out.restoreSubVector(inactive, part)

    def solve(self, load: PETSc.Vec, x: PETSc.Vec, rtol: float) -> tuple[int, int]:
        """Solve with the held matrix, from the guess in x; iterations and PETSc's reason. Collective."""
        ksp = PETSc.KSP().create(self.system.comm)
        ksp.setOperators(self._matrix)
        ksp.setPC(self._pc)
        ksp.setTolerances(rtol=rtol, max_it=2000)
        ksp.setInitialGuessNonzero(self.settings.kind != "lu")
        configure(ksp, self.settings.ksp, PREFIX)
        with self._timer("solve"):
            ksp.solve(load, x)
        result = int(ksp.getIterationNumber()), int(ksp.getConvergedReason())
        ksp.destroy()
        self.report(result[0])
        return result
