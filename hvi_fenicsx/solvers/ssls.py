"""PETSc's semismooth Newton method (SNES VI, ``vinewtonssls``) on the smoothed law: a method to compare with.

It writes the inequality as a system of Fischer-Burmeister functions and searches along Newton's direction for a smaller
norm of them. PETSc's own test asks for a small norm relative to the first one, and has accepted points that are no
solutions (solver-notes.md); here the residual of the inequality decides, at the iterate moved onto the bounds that it
nearly touches. Any option may be overridden under the prefix ``hvi_``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from ..compat import NOT_A_NUMBER
from ..system.petsc_options import configure
from ..system.system import System
from .smooth_method import SmoothMethod, SolverRun

_DIRECT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps", "mat_mumps_icntl_14": 100}
_KRYLOV = {
    "ksp_type": "gmres",
    "ksp_rtol": 1e-6,
    "ksp_gmres_restart": 100,
    "pc_type": "gamg",
    "pc_gamg_threshold": 0.01,
}
"""The semismooth Jacobian is not symmetric: its rows, and not its columns, are scaled."""
_Reason = PETSc.SNES.ConvergedReason


def onto_bounds(system: System, x: PETSc.Vec, residual: PETSc.Vec) -> PETSc.Vec:
    """An admissible copy of x, with those dofs on their bound whose force there is larger than their distance from it.

    Fischer-Burmeister iterates come near their bounds without ever being on them. Nondimensional nodal stiffnesses are
    about 1, so distances compare with forces, as in the primal-dual active set method.

    Args:
        system: the assembled problem.
        x: the displacement.
        residual: of the equations at x.
    """
    found = x.copy()
    value, force = x.array_r, residual.array_r
    lower, upper = system.lower.array_r, system.upper.array_r
    found.array[:] = np.where(value - lower <= force, lower, np.where(upper - value <= -force, upper, value))
    found.array[:] = np.clip(found.array_r, lower, upper)
    return found


class _SnesRun(SolverRun):
    """The callbacks of one SNES solve."""

    reasons = _Reason

    def iterate(self, solver: PETSc.SNES, x: PETSc.Vec) -> None:
        """Run SNES. Collective."""
        solver.solve(None, x)

    def count(self, solver: PETSc.SNES) -> None:
        """Newton and linear iterations."""
        super().count(solver)
        self.counts.linear = solver.getLinearSolveIterations()

    def create(self) -> PETSc.SNES:
        """``vinewtonssls``, whose Jacobian is not symmetric."""
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, False)
        snes = PETSc.SNES().create(self.system.comm)
        snes.setType("vinewtonssls")
        equations, residual = self.system.equations, self.system.load.duplicate()
        snes.setFunction(lambda _, x, f: equations.residual(x, f, self.models), residual)
        snes.setJacobian(self._tangent, self.matrix)
        snes.setVariableBounds(self.system.lower, self.system.upper)
        snes.setConvergenceTest(self._converged)
        snes.setTolerances(max_it=self.options.max_iterations)
        linear = _DIRECT if self.solver.settings.kind in ("lu", "mixed") else _KRYLOV
        configure(snes, {"snes_linesearch_type": "bt", **linear})
        return snes

    def _tangent(self, snes: PETSc.SNES, x: PETSc.Vec, j: PETSc.Mat, p: PETSc.Mat) -> None:
        self.system.jacobian.set_rates(self.system.equations.tangents(x, self.models))
        self.system.jacobian.matrix.copy(j, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)

    def judge(self, x: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """The candidate on its bounds, and its residual of the inequality. Collective."""
        self.system.equations.residual(x, self.residual, self.models)
        return super().judge(onto_bounds(self.system, x, self.residual))

    def _converged(self, snes: PETSc.SNES, iteration: int, norms: Any) -> int:
        found, measure = self.judge(snes.getSolution())
        self.context.tell("ssls", self.context.epsilon, iteration, measure, self.solver.in_contact(found))
        found.destroy()
        if measure <= self.options.tolerance:
            return _Reason.CONVERGED_FNORM_RELATIVE
        self.stopped = self.solver.interrupted()
        if self.stopped:
            return _Reason.DIVERGED_FUNCTION_COUNT
        return _Reason.CONVERGED_ITERATING if np.isfinite(measure) else NOT_A_NUMBER


class SemismoothNewton(SmoothMethod):
    """``vinewtonssls``."""

    name = "ssls"
    description = "a semismooth Newton method on the Fischer-Burmeister function"
    run = _SnesRun
    solver_name = "vinewtonssls"
