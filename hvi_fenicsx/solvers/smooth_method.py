"""The base of methods that differentiate the law: they refuse kinks, begin at rest, and converge by the inequality."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from petsc4py import PETSc

from ..errors import InputError
from ..system.petsc_errors import raise_python_error
from ..system.system import System
from .closed_start import resting_start
from .context import SolveContext
from .law_models import Cells, ExactLaw
from .method import Method
from .result import Counts, SolveResult


class SolverRun(ABC):
    """One solve by a PETSc object (SNES, TAO), and its callbacks.

    Attributes:
        models: what takes the place of the laws, by term.
        counts: iterations.
        stopped: whether it was asked to end.
        matrix: for the Hessian; a copy of the system's, which PETSc scales or shifts, and which may be indefinite.
        reasons: PETSc's enumeration of reasons to end.
    """

    reasons: type

    def __init__(self, context: SolveContext, x: PETSc.Vec) -> None:
        self.context, self.solver, self.system = context, context.solver, context.system
        self.options = context.options
        self.models = smooth_models(self.system)
        self.counts, self.stopped = Counts(), False
        self.residual = x.duplicate()
        self.matrix = self.system.jacobian.matrix.copy()
        self.matrix.setOption(PETSc.Mat.Option.SPD, False)

    @abstractmethod
    def create(self) -> Any:
        """The configured PETSc object."""

    @abstractmethod
    def iterate(self, solver: Any, x: PETSc.Vec) -> None:
        """Let the PETSc object solve. Collective.

        Args:
            solver: the object that :meth:`create` returned.
            x: start and result.
        """

    def execute(self, x: PETSc.Vec) -> str:
        """Solve from and into x; PETSc's name of the reason to end. Collective."""
        solver = self.create()
        try:
            self.iterate(solver, x)
            reason = self._name_of(solver.getConvergedReason())
        except PETSc.Error as error:
            raise_python_error(error)
            reason = f"PETSc error {error.ierr}"
        self.count(solver)
        for thing in (solver, self.matrix):
            thing.destroy()
        return "interrupted" if self.stopped else reason

    def _name_of(self, reason: int) -> str:
        names = {v: k for k, v in vars(self.reasons).items() if isinstance(v, int) and "_" in k}
        return names.get(int(reason), str(reason))

    def count(self, solver: Any) -> None:
        """Take the iterations from the PETSc object."""
        self.counts.newton = solver.getIterationNumber()

    def judge(self, x: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """The candidate for a solution at x, and its residual of the inequality. Collective."""
        self.system.equations.residual(x, self.residual, self.models)
        return x, self.solver.measure(x, self.residual, self.system.lower, self.system.upper)


class SmoothMethod(Method):
    """A method on one system with smooth laws, from the resting start; call :meth:`solve` once.

    Class attributes:
        run: the class of its solve.
        solver_name: the solver's name in messages.

    Raises:
        InputError: a law has kinks.
    """

    run: ClassVar[type[SolverRun]]
    solver_name: ClassVar[str]
    takes_pieces = False

    def __init__(self, context: SolveContext) -> None:
        super().__init__(context)
        refuse_kinks(context.system, self.name)

    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point of the smoothed energy, or what was found instead. Collective.

        Args:
            start: not used; it begins at rest.
        """
        system = self.system
        x, linear = resting_start(self.solver, [t.law for t in system.terms])
        run = self.run(self.context, x)
        with self.context.timer("solve"):
            reason = run.execute(x)
            found, measure = run.judge(x)
        run.counts.linear += linear
        converged = measure <= self.options.tolerance
        failure = f"{self.solver_name} stopped: {reason}, residual {measure:.1e}"
        return SolveResult(
            u=system.displacement(found),
            method=self.name,
            converged=converged,
            reason="stationary" if converged else failure,
            counts=run.counts,
            energies=(system.equations.energy(found, run.models),),
            interrupted=run.stopped,
        )


def refuse_kinks(system: System, method: str) -> None:
    """Refuse laws with kinks, which methods that differentiate a law cannot solve.

    Args:
        system: the assembled problem.
        method: the method's name.

    Raises:
        InputError: on all ranks alike.
    """
    for term in system.terms:
        if len(term.law.kinks):
            at = float(np.min(np.abs(term.law.kinks))) * system.problem.scales.displacement
            raise InputError(
                f'solver.method = "{method}" needs laws without kinks; that on boundary.{term.surface.part} has one at '
                f'{at:.3g} m: add smoothing = "quadratic" and epsilon = 0.01 to [solver] ("paper" keeps a kink at '
                'zero slip), or use method = "auto", which solves the law itself'
            )


def smooth_models(system: System) -> list[ExactLaw]:
    """The laws with their true curvature, by term; they have no kinks, so each has one cell."""
    return [ExactLaw(t.law, Cells.around(t.law.convex, np.zeros(len(t.surface.blocks)))) for t in system.terms]
