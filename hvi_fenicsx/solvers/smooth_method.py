"""What methods that differentiate the law share: they refuse kinks, begin at rest, and are judged by the inequality."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from petsc4py import PETSc

from ..errors import InputError
from ..system.system import System
from .active_set import ActiveSetSolver
from .law_models import Cells, Full
from .method import Counts, Settings, SolveResult, resting_start


class Run(ABC):
    """One solve by a method: a PETSc object (SNES, TAO) and what it calls back.

    Attributes:
        models: what stands for the laws. counts: iterations. stopped: whether it was told to end.
        matrix: for the Hessian; a copy of the system's, which PETSc scales or shifts, and which may be indefinite.
        reasons: PETSc's enumeration of why it ended.
    """

    reasons: type

    def __init__(self, solver: ActiveSetSolver, settings: Settings, x: PETSc.Vec) -> None:
        self.solver, self.settings, self.system = solver, settings, solver.system
        self.models = smooth_models(self.system)
        self.counts, self.stopped = Counts(), False
        self.residual = x.duplicate()
        self.matrix = self.system.matrix.copy()
        self.matrix.setOption(PETSc.Mat.Option.SPD, False)

    @abstractmethod
    def create(self) -> Any:
        """The configured PETSc object."""

    @abstractmethod
    def iterate(self, made: Any, x: PETSc.Vec) -> None:
        """Let it solve, from and into x. Collective."""

    def execute(self, x: PETSc.Vec) -> str:
        """Iterate from and into x; PETSc's name of its reason to end. Collective."""
        made = self.create()
        try:
            self.iterate(made, x)
            reason = self._words(made.getConvergedReason())
        except PETSc.Error as error:
            reason = f"PETSc error {error.ierr}"
        self.count(made)
        for thing in (made, self.matrix):
            thing.destroy()
        return "interrupted" if self.stopped else reason

    def _words(self, reason: int) -> str:
        names = {v: k for k, v in vars(self.reasons).items() if isinstance(v, int) and "_" in k}
        return names.get(int(reason), str(reason))

    def count(self, made: Any) -> None:
        """Read off its iterations."""
        self.counts.newton = made.getIterationNumber()

    def judge(self, x: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """The candidate that x stands for, and its residual of the inequality. Collective."""
        self.system.residual(x, self.residual, self.models)
        return x, self.solver.measure(x, self.residual, self.system.lower, self.system.upper)


class SmoothMethod:
    """A method on one system with smooth laws, from the resting start; call :meth:`solve` once.

    Attributes:
        run: the class of its solve. solver_words: what it calls itself where it failed.

    Raises:
        InputError: a law has kinks.
    """

    name: str
    words: str
    takes_start = False
    run: type[Run]
    solver_words: str

    def __init__(self, solver: ActiveSetSolver, settings: Settings) -> None:
        refuse_kinks(solver.system, self.name)
        self.solver, self.settings = solver, settings

    def solve(self) -> SolveResult:
        """A stationary point of the smoothed energy, or what was reached. Collective."""
        system = self.solver.system
        x, linear = resting_start(self.solver, [t.law for t in system.terms])
        run = self.run(self.solver, self.settings, x)
        with self.solver.timer("solve"):
            reason = run.execute(x)
            found, measure = run.judge(x)
        run.counts.linear += linear
        converged = measure <= self.settings.tolerance
        words = "stationary" if converged else f"{self.solver_words} stopped: {reason}, residual {measure:.1e}"
        energies = (system.energy(found, run.models),)
        return SolveResult(system.displacement(found), self.name, converged, words, run.counts, energies, run.stopped)


def refuse_kinks(system: System, method: str) -> None:
    """Methods that differentiate a law cannot solve one with kinks.

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


def smooth_models(system: System) -> list[Full]:
    """The laws with their true curvature; they have no kinks, so each has one cell."""
    return [Full(t.law, Cells.around(t.law.convex, np.zeros(len(t.surface.blocks)))) for t in system.terms]
