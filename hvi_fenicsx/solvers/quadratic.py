"""Problems without nonsmooth laws: one linear solve, or one convex quadratic programme.

Without contact and with laws that are linear springs at most, the inequality is an equation: one KSP solve, no SNES.
With contact it is a convex quadratic programme with bounds on u·n: one SNES VI solve.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from petsc4py import PETSc

from ..system.equations import VertexModel
from ..system.system import System
from .active_set import ENERGY, EXACT, Attempt
from .convergence import Counts, Outcome
from .method import Method, SolveResult, SolverTable, find
from .resting_start import at_rest, resting_start


def is_equation(system: System) -> bool:
    """Whether nothing nonsmooth acts: no bounds, and laws that are linear springs at most. The same on all ranks."""
    return not system.bounds and is_quadratic(system)


def is_quadratic(system: System) -> bool:
    """Whether the energy is quadratic: laws that are linear springs at most. The same on all ranks."""
    return all(term.is_linear for term in system.terms)


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
        outcome, left, falls = Outcome(False, 0, 0, float("inf"), "not started"), float("inf"), True
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


class ConvexProgramme(Method):
    """The quadratic programme on one system; call :meth:`solve` once."""

    name = "convex"
    description = "one convex quadratic programme by SNES VI (reduced space)"
    takes_start = True
    in_scenes = False

    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """The minimiser, or what was reached. Collective.

        Args:
            start: where to begin; by default with contact closed.
        """
        counts = Counts()
        if start is None:
            x, counts.linear = resting_start(self.solver, [term.law for term in self.system.terms])
        else:
            x = start.copy()
        with self.solver.reporting(self._progress):
            outcome = self._minimise(x, counts)
        return self.result(x, outcome, counts, steady=counts.newton <= 1)

    def _progress(self, iteration: int, residual: float, contact: int) -> None:
        self.context.tell(self.name, None, iteration, residual, contact)

    def _minimise(self, x: PETSc.Vec, counts: Counts) -> Outcome:
        """Attempts until one converges, from and into x; the outcome of the best one. Collective."""
        bounds = self.system.lower, self.system.upper
        tolerance, most = self.options.tolerance, self.options.max_iterations
        return self.solver.first_success(x, self._attempts(counts), tolerance, bounds, counts, most)

    def _attempts(self, counts: Counts) -> Iterator[Attempt]:
        """From the start, then from bodies at rest on their supports."""
        models = [VertexModel(term.law) for term in self.system.terms]
        yield Attempt(models=models, steady=self.context.steady)
        yield Attempt(models=models, start=self._from_rest(models, counts))
        yield Attempt(models=models, line_search=EXACT, foundation=self.system.thresholds.foundation)
        yield Attempt(models=models, line_search=ENERGY)

    def _from_rest(self, models: list[VertexModel], counts: Counts) -> PETSc.Vec | None:
        """The displacement of bodies at rest on their supports; None where there is none."""
        rtol = min(self.system.thresholds.coarse_tolerance, self.options.tolerance)
        laws = [term.law for term in self.system.terms]
        rested = at_rest(self.context, laws, lambda _: models, rtol)
        if rested is None:
            return None
        counts.linear += rested[1]
        return rested[0]


def choose(options: SolverTable, system: System) -> type[Method]:
    """The method that solves a system: the one that is named, or the simplest that the effects allow.

    Args:
        options: with the name of the method.
        system: the assembled problem.

    Raises:
        InputError: there is no such method.
    """
    if options.method == "auto" and is_quadratic(system):
        return LinearSolve if is_equation(system) else ConvexProgramme
    return find(options.method)
