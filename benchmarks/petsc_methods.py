"""PETSc's own methods for bounds as methods of a scene, to compare with: a plugin, as a user's own method would be.

    plugins = "petsc_methods.py"    # then solver.method = "tao" or "ssls"; relative to the scene file

``tao`` is TAO's bound-constrained Newton line search (``bnls``): it sees the true gradient and the true, perhaps
indefinite Hessian, and its preconditioner is that of the law's convex part. ``ssls`` is SNES VI's semismooth Newton
method (``vinewtonssls``): its own test has accepted points that are no solutions, so here the residual of the
inequality decides, at the iterate moved onto the bounds that it nearly touches. Both differentiate the law, so they
refuse kinks. Any option may be overridden under the prefix ``hvi_`` (``-hvi_tao_type bntr``).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar

import numpy as np
from petsc4py import PETSc

from hvi_fenicsx.compat import NOT_A_NUMBER
from hvi_fenicsx.errors import InputError
from hvi_fenicsx.solvers.condensed import onto_bounds
from hvi_fenicsx.solvers.convergence import Counts
from hvi_fenicsx.solvers.method import Method, SolveContext, SolveResult
from hvi_fenicsx.solvers.resting_start import resting_start
from hvi_fenicsx.system.equations import VertexModel
from hvi_fenicsx.system.held_solver import HeldPreconditioner
from hvi_fenicsx.system.petsc_options import configure, raise_python_error
from hvi_fenicsx.system.system import System

TAO_REASON, SNES_REASON = PETSc.TAO.ConvergedReason, PETSc.SNES.ConvergedReason
FOUNDATION = 1e-3
"""Stiffness per area, in units of E0/L, that keeps TAO's preconditioner regular where the body is free to move."""
_DIRECT = {"ksp_type": "preonly", "pc_type": "lu", "pc_factor_mat_solver_type": "mumps", "mat_mumps_icntl_14": 100}
_KRYLOV = {
    "ksp_type": "gmres",
    "ksp_rtol": 1e-6,
    "ksp_gmres_restart": 100,
    "pc_type": "gamg",
    "pc_gamg_threshold": 0.01,
}
"""The semismooth Jacobian is not symmetric: its rows, and not its columns, are scaled."""


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
        self.models = [VertexModel(term.law) for term in self.system.terms]
        self.counts, self.stopped = Counts(), False
        self.residual = x.duplicate()
        self.matrix = self.system.jacobian.matrix.copy()
        self.matrix.setOption(PETSc.Mat.Option.SPD, False)

    @abstractmethod
    def create(self) -> Any:
        """The configured PETSc object."""

    @abstractmethod
    def iterate(self, solver: Any, x: PETSc.Vec) -> None:
        """Let the PETSc object solve. Collective."""

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
        return x, self.solver.convergence.sizes(x, self.residual, self.system.lower, self.system.upper).worst


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
        """A stationary point of the smoothed energy, or what was found instead. Collective."""
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


class _TaoRun(SolverRun):
    """The callbacks of one TAO solve; each step of the preconditioner counts its linear iteration."""

    reasons = TAO_REASON

    def iterate(self, solver: PETSc.TAO, x: PETSc.Vec) -> None:
        """Run TAO. Collective."""
        solver.solve(x)

    def create(self) -> PETSc.TAO:
        """``bnls`` on the true Hessian."""
        tao = PETSc.TAO().create(self.system.comm)
        tao.setType("bnls")
        tao.setObjective(lambda _, x: self.system.equations.energy(x, self.models))
        tao.setGradient(lambda _, x, g: self.system.equations.residual(x, g, self.models), None)
        rows = _numbered_rows(self.system)
        tao.setHessian(self._tangent, self.matrix, rows)
        tao.setVariableBounds((self.system.lower, self.system.upper))
        tao.setConvergenceTest(self._converged)
        tao.setMaximumIterations(self.options.max_iterations)
        configure(tao, {})
        pc = tao.getKSP().getPC()
        if pc.getType() == PETSc.PC.Type.LMVM:  # the default of bnls: the user set none
            pc.setType(PETSc.PC.Type.PYTHON)
            pc.setPythonContext(_ReducedPC(self.solver.held, self.counts))
        return tao

    def _tangent(self, tao: PETSc.TAO, x: PETSc.Vec, h: PETSc.Mat, rows: PETSc.Mat) -> None:
        """The true Hessian for TAO; the system is left with the tangent of the preconditioner."""
        self.system.jacobian.set_rates(self.system.equations.tangents(x, self.models))
        self.system.jacobian.matrix.copy(h, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self.system.jacobian.set_rates(self._convex(x))

    def _convex(self, x: PETSc.Vec) -> list[Any]:
        """The tangent of the laws' convex parts, with a foundation on Γc, by term."""
        rates = []
        for term in self.system.terms:
            argument = term.argument(x.array_r)
            part = term.law.convex
            rate = term.rate(x.array_r, part.right(argument), part.second(argument))
            rates.append(rate + FOUNDATION * term.free[:, :, None] * np.eye(term.free.shape[1]))
        return rates

    def _converged(self, tao: PETSc.TAO) -> int | None:
        x, iteration = tao.getSolution(), tao.getIterationNumber()
        _, measure = self.judge(x)
        self.context.tell("tao", self.context.epsilon, iteration, measure, self.solver.convergence.in_contact(x))
        if measure <= self.options.tolerance:
            return TAO_REASON.CONVERGED_USER
        self.stopped = self.solver.interrupted()
        if self.stopped:
            return TAO_REASON.DIVERGED_USER
        if not np.isfinite(measure):
            return TAO_REASON.DIVERGED_NAN
        return TAO_REASON.DIVERGED_MAXITS if iteration >= tao.getMaximumIterations() else TAO_REASON.CONTINUE_ITERATING


def _numbered_rows(system: System) -> PETSc.Mat:
    """A diagonal matrix that holds each row's number.

    TAO has no function that returns its active set, but it gives the preconditioner the inactive rows of this matrix.
    """
    numbers = system.load.duplicate()
    numbers.array[:] = np.arange(*numbers.owner_range)
    sizes = system.jacobian.matrix.getSizes()
    rows = PETSc.Mat().createAIJ(sizes, nnz=1, comm=system.comm)
    rows.setDiagonal(numbers)
    rows.assemble()
    return rows


class _ReducedPC:
    """PETSc's view of :class:`HeldPreconditioner` on the inactive rows of a TAO step."""

    def __init__(self, held: HeldPreconditioner, counts: Counts) -> None:
        self._held, self._counts = held, counts
        self._in, self._out = held.system.load.duplicate(), held.system.load.duplicate()

    def setUp(self, pc: PETSc.PC) -> None:
        """Find the inactive rows and prepare for them."""
        rows = np.round(pc.getOperators()[1].getDiagonal().array_r).astype(PETSc.IntType)
        start, end = self._held.system.load.owner_range
        self._rows = rows - start
        self._in.set(0.0)
        active = np.setdiff1d(np.arange(start, end), rows, assume_unique=True)
        self._held.prepare((active - start).astype(np.int32))

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the preconditioner, y = P^-1 x, on the inactive rows."""
        self._counts.linear += 1  # one for each conjugate gradient step; TAO has the number of the last solve only
        self._in.array[self._rows] = x.array_r
        self._in.array[self._held.system.pins] = 0.0
        self._held.pc.apply(self._in, self._out)
        y.array[:] = self._out.array_r[self._rows]


class BoundedNewton(SmoothMethod):
    """``bnls``."""

    name = "tao"
    description = "PETSc TAO's bound-constrained Newton line search"
    run = _TaoRun
    solver_name = "TAO"


class _SslsRun(SolverRun):
    """The callbacks of one SNES solve."""

    reasons = SNES_REASON

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
        self.context.tell("ssls", self.context.epsilon, iteration, measure, self.solver.convergence.in_contact(found))
        found.destroy()
        if measure <= self.options.tolerance:
            return SNES_REASON.CONVERGED_FNORM_RELATIVE
        self.stopped = self.solver.interrupted()
        if self.stopped:
            return SNES_REASON.DIVERGED_FUNCTION_COUNT
        return SNES_REASON.CONVERGED_ITERATING if np.isfinite(measure) else NOT_A_NUMBER


class SemismoothNewton(SmoothMethod):
    """``vinewtonssls``."""

    name = "ssls"
    description = "a semismooth Newton method on the Fischer-Burmeister function"
    run = _SslsRun
    solver_name = "vinewtonssls"
