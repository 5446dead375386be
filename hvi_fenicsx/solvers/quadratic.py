"""Problems without nonsmooth laws: one linear solve, or one convex quadratic programme.

Without contact and with laws that are linear springs at most, the inequality is an equation: one KSP solve, no SNES.
With contact it is a convex quadratic programme with bounds on u·n: one SNES VI solve.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc

from ..system.equations import VertexModel
from ..system.system import System
from .convergence import Counts, Outcome
from .convex_step import is_quadratic
from .method import Method, SolveResult, SolverTable, find, load_all


class LinearSolve(Method):
    """The equation on one system; call :meth:`solve` once."""

    name = "linear"
    description = "one linear solve"
    in_scenes = False

    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """The solution of the equation, or what was reached. Collective.

        Args:
            start: not used; one linear solve needs none.
        """
        x, models, counts = self.system.undisplaced(), [VertexModel(term.law) for term in self.system.terms], Counts()
        outcome, left, falls = Outcome(False, 0, 0, np.inf, "not started"), np.inf, True
        while falls and not outcome.converged:
            outcome = self._step(x, models, left)
            counts.linear += outcome.linear
            falls, left = outcome.measure < self.system.thresholds.margin * left, outcome.measure
        self.context.tell(self.name, None, 1, outcome.measure, 0)
        return self.result(x, outcome, counts)

    def _step(self, x: PETSc.Vec, models: Sequence[VertexModel], left: float) -> Outcome:
        """One solve of the residual equation, of which ``left`` is known, and the residual left then. Collective."""
        rtol = self.system.thresholds.margin * self.options.tolerance / min(left, 1.0)
        step = self.solver.newton_step(x, np.empty(0, np.int32), models, rtol)
        bounds = self.system.lower, self.system.upper
        return self.solver.judged(step, x, models, self.options.tolerance, bounds)


def choose(options: SolverTable, system: System) -> type[Method]:
    """The method that solves a system: the one that is named, or the simplest that the effects allow.

    Args:
        options: with the name of the method.
        system: the assembled problem.

    Raises:
        InputError: there is no such method.
    """
    if options.method == "auto" and is_quadratic(system):
        load_all()
        return Method.registry["convex" if system.bounds else "linear"]
    return find(options.method)
