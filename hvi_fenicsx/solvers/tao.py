"""PETSc TAO's bound-constrained Newton line search (``bnls``) on the smoothed energy: a method to compare with.

It sees the true gradient and the true, perhaps indefinite Hessian; its truncated conjugate gradients follow negative
curvature to the edge of a trust region. The preconditioner is that of the law's convex part: positive definite.
Any option may be overridden under the prefix ``hvi_`` (``-hvi_tao_type bntr``).
"""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ..system.held_solver import HeldPreconditioner
from ..system.petsc_options import configure
from ..system.system import System
from ..typing import Array
from .result import Counts
from .smooth_method import SmoothMethod, SolverRun

_Reason = PETSc.TAO.ConvergedReason


class _TaoRun(SolverRun):
    """The callbacks of one TAO solve; each step of the preconditioner counts its linear iteration."""

    reasons = _Reason

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

    def _convex(self, x: PETSc.Vec) -> list[Array]:
        """The tangent of the laws' convex parts, with a foundation on Γc, by term."""
        rates, foundation = [], self.options.thresholds.foundation
        for term in self.system.terms:
            argument = term.argument(x.array_r)
            part = term.law.convex
            rate = term.rate(x.array_r, part.right(argument), part.second(argument))
            rates.append(rate + foundation * term.free[:, :, None] * np.eye(term.free.shape[1]))
        return rates

    def _converged(self, tao: PETSc.TAO) -> int | None:
        x, iteration = tao.getSolution(), tao.getIterationNumber()
        _, measure = self.judge(x)
        self.context.tell("tao", self.context.epsilon, iteration, measure, self.solver.in_contact(x))
        if measure <= self.options.tolerance:
            return _Reason.CONVERGED_USER
        self.stopped = self.solver.interrupted()
        if self.stopped:
            return _Reason.DIVERGED_USER
        if not np.isfinite(measure):
            return _Reason.DIVERGED_NAN
        return _Reason.DIVERGED_MAXITS if iteration >= tao.getMaximumIterations() else _Reason.CONTINUE_ITERATING


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

    def setUp(self, pc: PETSc.PC) -> None:
        """Find the inactive rows and prepare for them."""
        rows = np.round(pc.getOperators()[1].getDiagonal().array_r).astype(PETSc.IntType)
        self._held.select(PETSc.IS().createGeneral(rows, comm=pc.comm))
        start, end = self._held.system.load.owner_range
        active = np.setdiff1d(np.arange(start, end), rows, assume_unique=True)
        self._held.prepare((active - start).astype(np.int32))

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Apply the preconditioner, y = P^-1 x, on the inactive rows.

        Args:
            pc: the PC whose context this is.
            x: the vector, on the inactive rows.
            y: where the result is written.
        """
        self._counts.linear += 1  # one for each conjugate gradient step; TAO has the number of the last solve only
        self._held.apply_reduced(x, y)


class BoundedNewton(SmoothMethod):
    """``bnls``."""

    name = "tao"
    description = "PETSc TAO's bound-constrained Newton line search"
    run = _TaoRun
    solver_name = "TAO"
