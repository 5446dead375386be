"""One smooth, bound-constrained solve by PETSc's reduced-space active-set Newton method (SNES VI, ``vinewtonrsls``).

To PETSc's own method (solver-notes.md) it adds a convergence test on the residual of the inequality, an energy as merit
function, and a preconditioner that works at full size.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from petsc4py import PETSc

from ..compat import NOT_A_NUMBER
from ..runtime.cost import Timer
from ..system.equations import LawModel
from ..system.held_solver import HeldPreconditioner, LinearSettings
from ..system.multigrid import Levels
from ..system.petsc_options import default_options, prefix, raise_python_error
from ..system.system import System
from ..system.thresholds import Thresholds
from ..typing import Entities
from .convergence import NOT_MEASURED, ConvergenceTest, Outcome

StepReport = Callable[[int, float, int], None]
"""Called with iteration, residual, and vertices in contact (of all ranks)."""
_REASON = {v: k for k, v in vars(PETSc.SNES.ConvergedReason).items() if isinstance(v, int) and not k.startswith("_")}
_WORDS = {
    "DIVERGED_DTOL": "Newton's method makes no progress",
    "DIVERGED_LINE_SEARCH": "no step along Newton's direction lowers the energy",
    "DIVERGED_MAX_IT": "Newton's method has used up its steps",
    "DIVERGED_LINEAR_SOLVE": "a linear system was not solved",
    _REASON[NOT_A_NUMBER]: "the residual is no number",
}
"""What PETSc's reasons mean, for users."""


class ActiveSetSolver:
    """Bound-constrained minimisation over a system; keeps its preconditioner from solve to solve.

    Args:
        system: the assembled problem.
        levels: its coarser levels.
        settings: how linear systems are solved.
        timer: where time goes.
        interrupted: whether to stop (collective, asked at each Newton step).

    Attributes:
        convergence: the convergence test.
        held: the preconditioner.
        progress: what is told of each step; None for nothing.
    """

    def __init__(
        self,
        system: System,
        levels: Levels,
        settings: LinearSettings,
        timer: Timer,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.system, self.settings, self.timer = system, settings, timer
        self.held = HeldPreconditioner(system, levels, settings, timer)
        self.interrupted, self.thresholds = interrupted, system.thresholds
        self.convergence = ConvergenceTest(system)
        self.progress: StepReport | None = None
        self._residual = system.load.duplicate()

    def with_interruption(self, interrupted: Callable[[], bool]) -> ActiveSetSolver:
        """The same solver with another way to stop; both share the preconditioner."""
        other = copy.copy(self)
        other.interrupted = interrupted
        return other

    @contextmanager
    def reporting(self, progress: StepReport) -> Iterator[None]:
        """Report each step within a block only: a reporter refers to the solver, and neither would be freed."""
        before, self.progress = self.progress, progress
        try:
            yield
        finally:
            self.progress = before

    def destroy(self) -> None:
        """Free the PETSc objects."""
        self.held.destroy()
        self._residual.destroy()

    def in_contact(self, x: PETSc.Vec) -> int:
        """Vertices on a bound of the problem. Collective."""
        return self.convergence.in_contact(x)

    def measure(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> float:
        """The residual of the inequality over its scale: at most ``tolerance`` when solved. Collective.

        It is the largest of its norm relative to the forces of the body, of the largest nodal traction error on Γc
        relative to what is allowed there, and of the net forces along rigid motions; of all bodies the largest.

        Args:
            x: the displacement.
            residual: of the equations at x.
            lower: lower bounds.
            upper: upper bounds.
        """
        return self.convergence.sizes(x, residual, lower, upper).worst

    def newton_step(self, x: PETSc.Vec, held: Entities, models: Sequence[LawModel], rtol: float) -> Outcome:
        """One Newton step that leaves some unknowns as they are. Collective.

        Args:
            x: start and result.
            held: the unknowns that stay (local, owned).
            models: what takes the place of the laws, by term.
            rtol: relative tolerance of the linear solve.
        """
        self.system.jacobian.set_rates(self.system.equations.tangents(x, models))
        self.system.equations.residual(x, self._residual, models)
        self._residual.array[held] = 0.0
        self.held.prepare(held)
        step = x.duplicate()
        step.set(0.0)
        iterations, reason = self.held.solve(self._residual, step, rtol)
        step.array[held] = 0.0  # multigrid leaves rounding there, and a vertex must stay exactly on its bound
        finite = np.isfinite(step.norm())
        if finite:
            x.axpy(-1.0, step)
        step.destroy()
        return Outcome(reason > 0 and finite, 1, iterations, float("nan"), f"KSP reason {reason}")

    def solve(
        self,
        x: PETSc.Vec,
        models: Sequence[LawModel],
        tolerance: float,
        *,
        lower: PETSc.Vec,
        upper: PETSc.Vec,
        line_search: str = "bt",
        max_iterations: int = 60,
        steady: bool = False,
        foundation: float = 0.0,
    ) -> Outcome:
        """Minimise the energy of the models between the bounds. Collective.

        Args:
            x: start and result.
            models: what takes the place of the laws, by term.
            tolerance: of :meth:`measure`.
            lower: lower bounds.
            upper: upper bounds.
            line_search: PETSc's name; ``bt`` uses the energy.
            max_iterations: Newton steps at most.
            steady: whether x's active set is expected to be the final one; the first linear solve is then exact.
            foundation: as in :meth:`.Equations.tangents`; the residual has none, so the solution is the same.
        """
        bounds = lower, upper

        def once() -> Outcome:
            return self._once(x, _SnesRun(self, models, tolerance, bounds, steady=steady, foundation=foundation), *how)

        how = line_search, max_iterations
        with self.timer("solve"):
            self.system.evaluate_by_cells(x)
            found, left = once(), np.inf
            while not found.interrupted and found.measure <= self.thresholds.coarse_tolerance:
                self.system.evaluate_by_cells(x)
                self.system.equations.residual(x, self._residual, models)
                sizes = self.convergence.sizes(x, self._residual, *bounds)
                found = replace(found, converged=sizes.worst <= tolerance, measure=sizes.worst)
                if found.converged or sizes.worst > 0.5 * left:
                    return self.convergence.accept_rounding(found, sizes, x, tolerance)
                left, found = sizes.worst, found.followed_by(once())
            return found

    def _once(self, x: PETSc.Vec, run: _SnesRun, line_search: str, max_iterations: int) -> Outcome:
        """One run of SNES from and into x. Collective."""
        snes = run.create(line_search, max_iterations)
        try:
            snes.solve(None, x)
        except PETSc.Error as error:
            raise_python_error(error)
            run.failure = f"PETSc error {error.ierr}"
        finally:
            run.finish(snes)
        return run.outcome()

    def check_step(self, step: Outcome, x: PETSc.Vec, models: Sequence[LawModel], tolerance: float) -> Outcome:
        """The outcome of a step without bounds: converged if the residual at x is small enough. Collective.

        Args:
            step: the outcome of the linear solve.
            x: the result of the step.
            models: what takes the place of the laws, by term.
            tolerance: of :meth:`measure`.
        """
        self.system.evaluate_by_cells(x)
        self.system.equations.residual(x, self._residual, models)
        sizes = self.convergence.sizes_without_bounds(x, self._residual)
        found = replace(step, converged=sizes.worst <= tolerance, measure=sizes.worst)
        return self.convergence.accept_rounding(found, sizes, x, tolerance)


class _SnesRun:
    """The callbacks of one SNES solve.

    Attributes:
        failure: the error of PETSc that it ended with; else empty.
    """

    def __init__(
        self,
        owner: ActiveSetSolver,
        models: Sequence[LawModel],
        tolerance: float,
        bounds: tuple[PETSc.Vec, PETSc.Vec],
        *,
        steady: bool,
        foundation: float,
    ) -> None:
        self.owner, self.models, self.tolerance = owner, models, tolerance
        self.thresholds, self.steady, self.foundation = owner.thresholds, steady, foundation
        self.lower, self.upper = bounds
        self.last, self.linear, self.iterations, self.reason = float("inf"), 0, 0, 0
        self.sizes, self.failure = NOT_MEASURED, ""
        self.stopped = self.far = False

    def create(self, line_search: str, max_iterations: int) -> PETSc.SNES:
        """The configured SNES."""
        system = self.owner.system
        self._stalls = StallTest(self.thresholds, full_steps=line_search == FULL_STEPS)
        snes = PETSc.SNES().create(system.comm)
        snes.setType("vinewtonrsls")
        snes.setFunction(self._function, system.load.duplicate())
        snes.setJacobian(self._jacobian, unextracted(self.owner.held))
        snes.setVariableBounds(self.lower, self.upper)
        snes.setObjective(lambda _, x: system.equations.energy_from_base(x, self.models))
        snes.setConvergenceTest(self._converged)
        snes.setTolerances(max_it=max_iterations)
        near = self.thresholds.near * float(np.min(system.references.scale))
        with default_options(
            {"snes_linesearch_type": line_search, "snes_linesearch_max_it": 40, "snes_vi_zero_tolerance": near}
        ):
            snes.setOptionsPrefix(prefix())
            snes.getKSP().setOptionsPrefix(f"{prefix()}inactive_")
            snes.setFromOptions()
        self._set_linear_solve(snes)
        return snes

    def _set_linear_solve(self, snes: PETSc.SNES) -> None:
        """The KSP of the inactive dofs. The user's -ksp_type is for the one at full size that it calls."""
        ksp = snes.getKSP()
        ksp.getPC().setType(PETSc.PC.Type.NONE)
        ksp.setType(PETSc.KSP.Type.PYTHON)
        ksp.setPythonContext(InactiveSolve(snes, self.owner.held, self._goal))

    def _goal(self, *, moved: bool) -> float:
        """How exact a linear solve is: what the tolerance needs, but loose while the active set changes."""
        thresholds = self.thresholds
        least = thresholds.loose if moved else 0.0 if self.steady else thresholds.coarse_tolerance
        return max(thresholds.margin**2 * self.tolerance / self.last, least)

    def finish(self, snes: PETSc.SNES) -> None:
        """Take iterations and reason from the SNES, and free it."""
        self.iterations, self.reason = snes.getIterationNumber(), snes.getConvergedReason()
        self.linear = snes.getLinearSolveIterations()
        snes.destroy()

    def outcome(self) -> Outcome:
        """How it ended."""
        left = np.inf if self.failure or not np.isfinite(self.last) else self.last
        return Outcome(left <= self.tolerance, self.iterations, self.linear, left, self._reason(), self.stopped)

    def _reason(self) -> str:
        """Why it ended, in our words, and PETSc's."""
        if self.failure:
            return self.failure
        if self.far:
            return f"a displacement of more than {self.thresholds.runaway:.0e} times p0 L / E0"
        name = _REASON.get(int(self.reason), str(self.reason))
        words = f"{_WORDS[name]} ({name})" if name in _WORDS else name
        return "interrupted" if self.stopped else words

    def _function(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        self.owner.system.equations.residual(x, f, self.models)

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, j: PETSc.Mat, p: PETSc.Mat) -> None:
        system = self.owner.system
        system.jacobian.set_rates(system.equations.tangents(x, self.models, self.foundation))

    def _converged(self, snes: PETSc.SNES, iteration: int, norms: Any) -> int:
        x, (f, _) = snes.getSolution(), snes.getFunction()[:2]
        self.sizes = self.owner.convergence.sizes(x, f, self.lower, self.upper)
        self.last = self.sizes.worst
        if self.owner.progress:
            self.owner.progress(iteration, self.last, self.owner.in_contact(x))
        moved = self.owner.system.equations.from_base(x).norm(PETSc.NormType.INFINITY)
        self.far = moved > self.thresholds.runaway
        if self.last <= self.tolerance and not self.far:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        self.stopped = self.owner.interrupted()
        if self.stopped:
            return PETSc.SNES.ConvergedReason.DIVERGED_FUNCTION_COUNT
        if self.far or not np.isfinite(self.last):
            return NOT_A_NUMBER
        reasons = PETSc.SNES.ConvergedReason
        return reasons.DIVERGED_DTOL if self._stalls.gives_up(self.last) else reasons.CONVERGED_ITERATING


class StallTest:
    """Is told the residual of each step.

    Args:
        thresholds: when to give up.
        full_steps: whether no line search shortens the steps: these may go round in a circle for ever. Those of a
            search are of use where the energy falls, even if the residual does not.
    """

    def __init__(self, thresholds: Thresholds, *, full_steps: bool) -> None:
        self._thresholds, self._full_steps = thresholds, full_steps
        self._least = self._last = np.inf
        self._useless, self._stood = 0, False

    def gives_up(self, residual: float) -> bool:
        """Whether to give up after a step: for long none has halved the residual, or two in a row have not changed it.

        Args:
            residual: relative, after the step.
        """
        self._useless = 0 if residual < 0.5 * self._least else self._useless + 1
        small, before = self._thresholds.coarse_tolerance, self._stood
        self._stood = abs(residual - self._last) < small * self._last
        self._least, self._last = min(self._least, residual), residual
        counts = self._full_steps or residual < small
        return (before and self._stood) or (counts and self._useless >= self._thresholds.few_steps)


def unextracted(held: HeldPreconditioner) -> PETSc.Mat:
    """J for SNES VI: its inactive part is multiplied at full size instead of being copied."""
    sizes = held.system.jacobian.matrix.getSizes()
    matrix = PETSc.Mat().createPython(sizes, _FullMatrix(held), comm=held.system.comm)
    matrix.setUp()
    return matrix


class _FullMatrix:
    """PETSc's view of J, which is symmetric."""

    def __init__(self, held: HeldPreconditioner) -> None:
        self._held = held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply y = J x; a line search that fails needs it to test for a minimum of the residual's norm. Collective.

        Args:
            _: the matrix whose context this is.
            x: the vector.
            y: where the product is written.
        """
        self._held.system.jacobian.matrix.mult(x, y)

    multTranspose = mult

    def createSubMatrix(self, _: PETSc.Mat, rows: PETSc.IS, columns: PETSc.IS, into: PETSc.Mat | None) -> PETSc.Mat:
        """The rows and columns of the inactive dofs, of which only the size is asked. Collective.

        Args:
            _: the matrix whose context this is.
            rows: the inactive dofs.
            columns: the same.
            into: not used.
        """
        sizes = (rows.getLocalSize(), rows.getSize())
        matrix = PETSc.Mat().createPython((sizes, sizes), self, comm=rows.comm)
        matrix.setUp()
        return matrix


class InactiveSolve:
    """The linear solve of a SNES VI step on its inactive dofs, as PETSc's KSP: :class:`HeldPreconditioner` solves it.

    Args:
        snes: the solver, which knows the inactive dofs.
        held: the preconditioner, by which equations are solved at full size.
        goal: how exact a step is to be, by whether the active set has changed.
    """

    def __init__(self, snes: PETSc.SNES, held: HeldPreconditioner, goal: Callable[..., float]) -> None:
        self._snes, self._held, self._goal = snes, held, goal
        self._active: Entities | None = None

    def solve(self, ksp: PETSc.KSP, load: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve J x = load on the inactive dofs. Collective.

        Args:
            ksp: the KSP whose context this is.
            load: the right-hand side, on the inactive dofs.
            x: where the solution is written.
        """
        inactive = self._snes.getVIInactiveSet()
        goal = self._goal(moved=self._prepare(inactive))
        iterations, reason = self._held.solve_reduced(inactive, load, x, goal)
        ksp.setIterationNumber(iterations)
        ksp.setConvergedReason(reason)

    def _prepare(self, inactive: PETSc.IS) -> bool:
        """Prepare for the active dofs of this step; whether others were active in the last one. Collective."""
        start, end = self._held.system.load.owner_range
        active = np.ones(end - start, dtype=bool)
        active[inactive.getIndices() - start] = False
        found = np.flatnonzero(active).astype(np.int32)
        moved = self._active is not None and not np.array_equal(found, self._active)
        self._active = found
        self._held.prepare(found)
        return bool(self._held.system.comm.allreduce(moved))


FULL_STEPS = "basic"
"""PETSc's name of the line search that shortens no step."""
EXACT = "cp"
"""PETSc's name of the one that looks for where the slope of the energy along a step is zero."""
ENERGY = "bt"
"""PETSc's name of the one that backtracks by the energy."""
