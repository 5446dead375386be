"""One smooth, bound-constrained solve by PETSc's reduced-space active-set Newton method (SNES VI, ``vinewtonrsls``).

What the plain recipe lacks (solver-notes.md) is here: a convergence test on the residual of the inequality, an energy
as merit function, and a preconditioner that works at full size.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..runtime.timing import Timer
from ..system.held_solver import HeldPreconditioner, LinearSettings
from ..system.levels import Levels
from ..system.petsc_options import configure
from ..system.system import LawModel, System
from ..typing import Array, Entities
from .snes_views import ReducedPreconditioner, unextracted
from .thresholds import DEFAULT, Thresholds

StepReport = Callable[[int, float, int], None]
"""Called with iteration, residual, and vertices in contact (of all ranks)."""
Sizes = tuple[float, float]
"""Of a residual: its norm relative to the load's; its largest nodal traction relative to what is allowed on Γc."""
_ON_BOUND = 1e-12
_PATIENCE = 2
"""Steps in a row that show a stall."""
_REASON = {v: k for k, v in vars(PETSc.SNES.ConvergedReason).items() if isinstance(v, int) and not k.startswith("_")}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one solve ended.

    Attributes:
        converged: by our own test.
        newton: Newton steps.
        linear: iterations of linear solvers.
        measure: residual of the inequality, relative.
        reason: PETSc's name of the reason, or ours.
        interrupted: whether it was asked to stop.
        rounding: where the residual stood still, what rounding makes of it there; a residual no larger is converged.
    """

    converged: bool
    newton: int
    linear: int
    measure: float
    reason: str
    interrupted: bool = False
    rounding: float = 0.0


class ActiveSetSolver:
    """Bound-constrained minimisation over a system; keeps its preconditioner from solve to solve.

    Args:
        system: the assembled problem.
        levels: its coarser levels.
        settings: how linear systems are solved.
        timer: where time goes.
        interrupted: whether to stop (collective, asked at each Newton step).
        thresholds: how exact steps are, and when to give up.
    """

    def __init__(
        self,
        system: System,
        levels: Levels,
        settings: LinearSettings,
        timer: Timer,
        interrupted: Callable[[], bool] = lambda: False,
        thresholds: Thresholds = DEFAULT,
    ) -> None:
        self.system, self.settings, self.timer = system, settings, timer
        self.held = HeldPreconditioner(system, levels, settings, timer)
        self.interrupted, self.thresholds = interrupted, thresholds
        self.progress: StepReport | None = None
        self._residual = system.load.duplicate()
        self._allowed = system.residual_limits(1.0)[system.jacobian.rows.dofs]

    def stopped_by(self, interrupted: Callable[[], bool]) -> ActiveSetSolver:
        """The same solver with another way to stop; both share the preconditioner."""
        other = copy.copy(self)
        other.interrupted = interrupted
        return other

    @contextmanager
    def reporting(self, progress: StepReport) -> Iterator[None]:
        """Report to this as long as it lasts; then no more: a reporter holds the solver, and both would stay."""
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
        """Vertices on a bound of the scene. Collective."""
        at = self.system.jacobian.rows.dofs
        u, lower, upper = x.array_r[at], self.system.lower.array_r[at], self.system.upper.array_r[at]
        return int(self.system.comm.allreduce(int(np.count_nonzero((u <= lower) | (u >= upper)))))

    def measure(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> float:
        """The residual of the inequality over its scale: at most ``tolerance`` when solved. Collective.

        The larger of its norm relative to the load's, and of the largest nodal traction error on Γc relative to what is
        allowed there.

        Args:
            x: the displacement.
            residual: of the equations at x.
            lower: bounds from below.
            upper: bounds from above.
        """
        return max(self.sizes(x, residual, lower, upper))

    def sizes(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> Sizes:
        """The two of which :meth:`measure` is the larger. Collective.

        Args:
            x: the displacement.
            residual: of the equations at x.
            lower: bounds from below.
            upper: bounds from above.
        """
        at, r = self.system.jacobian.rows.dofs, residual.array_r.copy()
        r[at] = projected(x.array_r[at], r[at], lower.array_r[at], upper.array_r[at])
        return self._sizes(r)

    def _sizes(self, r: Array) -> Sizes:
        nodal = float(np.max(np.abs(r[self.system.jacobian.rows.dofs]) / self._allowed, initial=0.0))
        comm = self.system.comm
        norm = float(np.sqrt(comm.allreduce(float(r @ r)))) / self.system.scale
        return norm, float(comm.allreduce(nodal, op=MPI.MAX))

    def newton_step(self, x: PETSc.Vec, held: Entities, models: Sequence[LawModel], rtol: float) -> Outcome:
        """One Newton step with some unknowns kept at their values in x. Collective.

        Args:
            x: where it begins, and where it leads.
            held: the unknowns that are kept (local, owned).
            models: what stands for the laws, by term.
            rtol: relative tolerance of the linear solve.
        """
        self.system.jacobian.set_rates(self.system.tangents(x, models))
        self.system.residual(x, self._residual, models)
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
    ) -> Outcome:
        """Minimise the energy of the models between the bounds, from and into x. Collective.

        Args:
            x: start and result.
            models: what stands for the laws, by term.
            tolerance: of :meth:`measure`.
            lower: bounds from below.
            upper: bounds from above.
            line_search: PETSc's name; ``bt`` uses the energy.
            max_iterations: Newton steps at most.
            steady: whether x's active set is expected to stand; the first linear solve then goes to the tolerance.
        """
        with self.timer("solve"):
            run = _Run(self, models, tolerance, lower, upper)
            run.steady = steady
            snes = run.create(line_search, max_iterations)
            try:
                snes.solve(None, x)
            except PETSc.Error as error:
                return Outcome(False, snes.getIterationNumber(), run.linear, run.last, f"PETSc error {error.ierr}")
            finally:
                run.forget(snes)
            reason = _REASON.get(int(run.reason), str(run.reason))
            if run.stopped:
                reason = "interrupted"
            found = Outcome(run.last <= tolerance, run.iterations, run.linear, run.last, reason, run.stopped)
            return found if found.converged or run.stopped else self._to_rounding(found, run.sizes, x)

    def judged(self, step: Outcome, x: PETSc.Vec, models: Sequence[LawModel], tolerance: float) -> Outcome:
        """The outcome of a step without bounds: converged if the residual at x is small enough. Collective.

        Args:
            step: the outcome of the linear solve.
            x: where it led.
            models: what stands for the laws, by term.
            tolerance: of :meth:`measure`.
        """
        self.system.residual(x, self._residual, models)
        sizes = self._sizes(self._residual.array_r)
        found = replace(step, converged=max(sizes) <= tolerance, measure=max(sizes))
        return found if found.converged else self._to_rounding(found, sizes, x)

    def _to_rounding(self, found: Outcome, sizes: Sizes, x: PETSc.Vec) -> Outcome:
        """Accept a residual at the rounding floor as converged.

        Rounding of the body's forces is no excuse for a wrong traction on Γc: each of the two has its own floor.
        """
        thresholds = self.thresholds
        if not np.isfinite(found.measure) or not np.isfinite(x.norm()) or found.measure > thresholds.largest_rounding:
            return found
        noise = self.system.load.duplicate()
        self.system.rounding_sample(x, noise)
        floors = [thresholds.rounding_safety * size for size in self._sizes(noise.array_r)]
        noise.destroy()
        if any(size > floor for size, floor in zip(sizes, floors, strict=True)):
            return found
        return replace(found, converged=True, rounding=max(floors), reason="as small as rounding allows")


class _Run:
    """The callbacks of one SNES solve."""

    def __init__(
        self, owner: ActiveSetSolver, models: Sequence[LawModel], tolerance: float, lower: PETSc.Vec, upper: PETSc.Vec
    ) -> None:
        self.owner, self.models, self.tolerance = owner, models, tolerance
        self.lower, self.upper = lower, upper
        self.last, self.linear, self.iterations, self.reason = float("inf"), 0, 0, 0
        self.sizes: Sizes = (float("inf"), float("inf"))
        self._stalled = self._slow = 0
        self.stopped = self.steady = False

    def create(self, line_search: str, max_iterations: int) -> PETSc.SNES:
        """The configured SNES."""
        system = self.owner.system
        snes = PETSc.SNES().create(system.comm)
        snes.setType("vinewtonrsls")
        snes.setFunction(self._function, system.load.duplicate())
        snes.setJacobian(self._jacobian, unextracted(self.owner.held))
        snes.setVariableBounds(self.lower, self.upper)
        snes.setObjective(lambda _, x: system.energy(x, self.models))
        snes.setConvergenceTest(self._converged)
        snes.setTolerances(max_it=max_iterations)
        snes.getKSP().setTolerances(rtol=1e-4, atol=0.0, max_it=2000)
        snes.getKSP().setPC(self._preconditioner(snes))
        defaults = {"snes_linesearch_type": line_search, "snes_vi_zero_tolerance": _ON_BOUND}
        configure(snes, {**defaults, **self.owner.settings.ksp})
        return snes

    def _preconditioner(self, snes: PETSc.SNES) -> PETSc.PC:
        pc = snes.getKSP().getPC()
        pc.setType(PETSc.PC.Type.PYTHON)
        pc.setPythonContext(ReducedPreconditioner(snes, self.owner.held, self._accuracy))
        return pc

    def _accuracy(self, *, moved: bool) -> float:
        """How far a linear solve goes: to the tolerance, but not for an active set that is still on the move."""
        thresholds = self.owner.thresholds
        if self.steady and not moved:
            return thresholds.straight * self.tolerance / self.last
        wanted = thresholds.moving_accuracy if moved else thresholds.forcing * self.tolerance / self.last
        return max(wanted, thresholds.finest_accuracy)

    def forget(self, snes: PETSc.SNES) -> None:
        """Read off what is needed and free the SNES."""
        self.iterations, self.reason = snes.getIterationNumber(), snes.getConvergedReason()
        self.linear = snes.getLinearSolveIterations()
        if self.reason == PETSc.SNES.ConvergedReason.DIVERGED_LINEAR_SOLVE:
            self.owner.held.report(snes.getKSP().getIterationNumber())
        snes.destroy()

    def _function(self, snes: PETSc.SNES, x: PETSc.Vec, f: PETSc.Vec) -> None:
        self.owner.system.residual(x, f, self.models)

    def _jacobian(self, snes: PETSc.SNES, x: PETSc.Vec, j: PETSc.Mat, p: PETSc.Mat) -> None:
        system = self.owner.system
        system.jacobian.set_rates(system.tangents(x, self.models))

    def _converged(self, snes: PETSc.SNES, iteration: int, norms: Any) -> int:
        x, (f, _) = snes.getSolution(), snes.getFunction()[:2]
        if iteration:
            self.owner.held.report(snes.getKSP().getIterationNumber())
        self.sizes = self.owner.sizes(x, f, self.lower, self.upper)
        previous, self.last = self.last, max(self.sizes)
        if self.owner.progress:
            self.owner.progress(iteration, self.last, self.owner.in_contact(x))
        self.stopped = self.owner.interrupted()
        if self.stopped:
            return PETSc.SNES.ConvergedReason.DIVERGED_FUNCTION_COUNT
        if not np.isfinite(self.last) or x.norm(PETSc.NormType.INFINITY) > self.owner.thresholds.runaway:
            return PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
        if self.last <= self.tolerance:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        stalls = self._stalls(previous)
        return PETSc.SNES.ConvergedReason.DIVERGED_DTOL if stalls else PETSc.SNES.ConvergedReason.CONVERGED_ITERATING

    def _stalls(self, previous: float) -> bool:
        """Whether further steps will not lower the residual."""
        thresholds = self.owner.thresholds
        self._stalled = self._stalled + 1 if abs(self.last - previous) < thresholds.still * previous else 0
        self._slow = self._slow + 1 if self.last > 0.5 * previous else 0
        at_rounding = self.last < thresholds.rounding_below
        return self._stalled >= _PATIENCE or (at_rounding and self._slow >= 2 * _PATIENCE)


def projected(x: Array, residual: Array, lower: Array, upper: Array) -> Array:
    """The residual less what the bounds may carry: zero exactly where the inequality holds; shape (n,).

    Args:
        x: displacements, (n,).
        residual: of the equations, (n,).
        lower: bounds, (n,).
        upper: bounds, (n,).
    """
    at_lower, at_upper = x <= lower + _ON_BOUND, x >= upper - _ON_BOUND
    r = np.where(at_lower, np.minimum(residual, 0.0), residual)
    return np.where(at_upper, np.maximum(r, 0.0), r)
