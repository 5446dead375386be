"""PETSc's ``vinewtonrsls`` as it is usually written: the matrix, GAMG with its near-null space, the default tests."""

from __future__ import annotations

from typing import Any

from petsc4py import PETSc

from hvi_fenicsx.runtime.cost import Timer
from hvi_fenicsx.solvers.active_set import ActiveSetSolver
from hvi_fenicsx.solvers.resting_start import resting_start
from hvi_fenicsx.system.equations import Cells, VertexModel
from hvi_fenicsx.system.held_solver import LinearSettings
from hvi_fenicsx.system.system import System

_MOST = 100


def solve(system: System, tolerance: float) -> dict[str, Any]:
    """Seconds are taken by the caller; iterations, and whether the inequality holds within the tolerance."""
    solver = ActiveSetSolver(system, (), LinearSettings.choose(system, "gamg"), Timer())
    x, _ = resting_start(solver, [t.law for t in system.terms], tolerance)
    models = [
        VertexModel(t.law, Cells.around(t.law.convex, t.argument(x.array_r), radial=t.radial)) for t in system.terms
    ]
    snes = PETSc.SNES().create(system.comm)
    snes.setType("vinewtonrsls")
    residual, equations, jacobian = system.load.duplicate(), system.equations, system.jacobian
    snes.setFunction(lambda _, u, f: equations.residual(u, f, models), residual)
    jacobian.matrix.setNearNullSpace(system.near_null)
    snes.setJacobian(lambda _, u, j, p: jacobian.set_rates(equations.tangents(u, models)), jacobian.matrix)
    snes.setVariableBounds(system.lower, system.upper)
    snes.setTolerances(atol=0.0, rtol=tolerance, max_it=_MOST)
    snes.getKSP().setType("cg")
    snes.getKSP().setTolerances(rtol=tolerance)
    snes.getKSP().getPC().setType("gamg")
    snes.solve(None, x)
    equations.residual(x, residual, models)
    measure = solver.convergence.sizes(x, residual, system.lower, system.upper).worst
    return {
        "newton": snes.getIterationNumber(),
        "linear": snes.getLinearSolveIterations(),
        "certified": measure <= 10 * tolerance,
    }
