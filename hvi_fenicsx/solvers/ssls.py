"""PETSc's semismooth Newton method (SNES VI, ``vinewtonssls``) on the smoothed law: a method to compare with.

It writes the inequality as a system of Fischer-Burmeister functions and searches along Newton's direction for a smaller
norm of them. PETSc's own test asks for a small norm relative to the first one and has been seen to claim what is not so
(solver-notes.md); here the residual of the inequality decides, at the iterate moved onto the bounds it nearly touches.
Any option may be overridden under the prefix ``hvi_``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from ..system import System
from .activeset import ActiveSetSolver
from .base import Counts, Settings
from .options import configure
from .smooth import SmoothMethod, smooth_models

_DIRECT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps"}
_KRYLOV = {
    "ksp_type": "gmres",
    "ksp_rtol": 1e-6,
    "ksp_gmres_restart": 100,
    "pc_type": "gamg",
    "pc_gamg_threshold": 0.01,
}
"""The semismooth Jacobian is not symmetric: its rows, and not its columns, are scaled."""
_Reason = PETSc.SNES.ConvergedReason
_NAMES = {v: k for k, v in vars(_Reason).items() if isinstance(v, int) and "_" in k}


def onto_bounds(system: System, x: PETSc.Vec, residual: PETSc.Vec) -> PETSc.Vec:
    """A copy of x, admissible, with those dofs on their bound whose force there outweighs their distance from it.

    Fischer-Burmeister iterates come near their bounds without ever being on them. Nondimensional nodal stiffnesses are
    about 1, so distances compare with forces, as in the primal-dual active set method.
    """
    found = x.copy()
    value, force = x.array_r, residual.array_r
    lower, upper = system.lower.array_r, system.upper.array_r
    found.array[:] = np.where(value - lower <= force, lower, np.where(upper - value <= -force, upper, value))
    found.array[:] = np.clip(found.array_r, lower, upper)
    return found


class _Run:
    """The callbacks of one SNES solve."""

    def __init__(self, solver: ActiveSetSolver, settings: Settings, x: PETSc.Vec) -> None:
        self.solver, self.settings, self.system = solver, settings, solver.system
        self.models = smooth_models(self.system)
        self.counts, self.stopped = Counts(), False
        self._residual = x.duplicate()
        self._jacobian = self.system.matrix.copy()  # not the system's own: PETSc scales its rows
        self._jacobian.setOption(PETSc.Mat.Option.SPD, False)
        self._jacobian.setOption(PETSc.Mat.Option.SYMMETRIC, False)

    def execute(self, x: PETSc.Vec) -> str:
        """Run SNES from and into x; PETSc's name of its reason. Collective."""
        snes = self._create()
        try:
            snes.solve(None, x)
            reason = _NAMES.get(int(snes.getConvergedReason()), str(snes.getConvergedReason()))
        except PETSc.Error as error:
            reason = f"PETSc error {error.ierr}"
        self.counts.newton, self.counts.linear = snes.getIterationNumber(), snes.getLinearSolveIterations()
        for thing in (snes, self._jacobian):
            thing.destroy()
        return "interrupted" if self.stopped else reason

    def _create(self) -> PETSc.SNES:
        snes = PETSc.SNES().create(self.system.comm)
        snes.setType("vinewtonssls")
        snes.setFunction(lambda _, x, f: self.system.residual(x, f, self.models), self.system.load.duplicate())
        snes.setJacobian(self._tangent, self._jacobian)
        snes.setVariableBounds(self.system.lower, self.system.upper)
        snes.setConvergenceTest(self._converged)
        snes.setTolerances(max_it=self.settings.max_newton)
        linear = _DIRECT if self.solver.settings.kind == "lu" else _KRYLOV
        configure(snes, {"snes_linesearch_type": "bt", **linear})
        return snes

    def _tangent(self, snes: PETSc.SNES, x: PETSc.Vec, j: PETSc.Mat, p: PETSc.Mat) -> None:
        self.system.set_rates(self.system.tangents(x, self.models))
        self.system.matrix.copy(j, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)

    def judge(self, x: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """The candidate that x stands for, and its residual of the inequality. Collective."""
        self.system.residual(x, self._residual, self.models)
        found = onto_bounds(self.system, x, self._residual)
        self.system.residual(found, self._residual, self.models)
        return found, self.solver.measure(found, self._residual, self.system.lower, self.system.upper)

    def _converged(self, snes: PETSc.SNES, iteration: int, norms: Any) -> int:
        found, measure = self.judge(snes.getSolution())
        self.settings.progress("ssls", self.settings.epsilon, iteration, measure, self.solver.in_contact(found))
        found.destroy()
        self.stopped = self.solver.interrupted()
        if self.stopped:
            return _Reason.DIVERGED_FUNCTION_COUNT
        if not np.isfinite(measure):
            return _Reason.DIVERGED_FNORM_NAN
        return _Reason.CONVERGED_FNORM_RELATIVE if measure <= self.settings.tolerance else _Reason.CONVERGED_ITERATING


class SemismoothNewton(SmoothMethod):
    """``vinewtonssls``."""

    name = "ssls"
    words = "a semismooth Newton method on the Fischer-Burmeister function"
    run = _Run
    solver_words = "vinewtonssls"
