"""One smooth, bound-constrained solve by PETSc's reduced-space active-set Newton method (SNES VI, ``vinewtonrsls``).

What the plain recipe lacks (solver-notes.md) is here: a convergence test on the residual of the inequality, an energy
as merit function, and a preconditioner that works at full size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..runtime.timing import Timer
from ..system.held_solver import HeldPreconditioner, LinearSettings
from ..system.petsc_options import configure
from ..system.system import Model, System
from ..typing import Array, Entities

Progress = Callable[[int, float, int], None]
"""Called with iteration, residual, and vertices in contact (of all ranks)."""
Sizes = tuple[float, float]
"""Of a residual: its norm relative to the load's; its largest nodal traction relative to what is allowed on Γc."""
_ON_BOUND = 1e-12
_STILL, _PATIENCE = 1e-3, 2
"""So many steps that change the residual by less than this fraction: the line search no longer sees the energy fall."""
_ROUNDING = 1e-7
"""Below this, twice as many steps without halving the residual mean that rounding allows no more."""
_LARGEST_ROUNDING, _SAFETY = 1e-4, 4.0
"""A residual above the first is no rounding; the sample of the rounding error is trusted within the second."""
_INEXACT, _FORCING, _FINEST = 1e-2, 0.5, 1e-4
"""Relative tolerance of a step's linear solve: while the active set moves; as a part of what is left; the least."""
_STRAIGHT = 0.125
"""The second where one step shall do: nodal tractions fall by a quarter as much as the norm, where ranks meet on Γc."""
_RUNAWAY = 1e8
"""A displacement of so many times p0 L / E0 is a body that slides away."""
_REASON = {v: k for k, v in vars(PETSc.SNES.ConvergedReason).items() if isinstance(v, int) and not k.startswith("_")}


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one solve ended.

    Attributes:
        converged: by our own test. newton, linear: iterations. measure: residual of the inequality, relative.
        reason: PETSc's name of the reason, or ours. interrupted: whether it was told to stop.
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
    """Bound-constrained minimisation over a system; keeps its preconditioner from solve to solve."""

    def __init__(
        self,
        system: System,
        settings: LinearSettings,
        timer: Timer,
        interrupted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.system, self.settings, self.timer = system, settings, timer
        self.held = HeldPreconditioner(system, settings, timer)
        self.interrupted = interrupted
        self.progress: Progress | None = None
        self._residual = system.load.duplicate()
        self._allowed = system.allowed(1.0)[system.rows.dofs]

    @contextmanager
    def reporting(self, progress: Progress) -> Iterator[None]:
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
        at = self.system.rows.dofs
        u, lower, upper = x.array_r[at], self.system.lower.array_r[at], self.system.upper.array_r[at]
        return int(self.system.comm.allreduce(int(np.count_nonzero((u <= lower) | (u >= upper)))))

    def measure(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> float:
        """The residual of the inequality over its scale: at most ``tolerance`` when solved. Collective.

        The larger of its norm relative to the load's, and of the largest nodal traction error on Γc relative to what is
        allowed there.
        """
        return max(self.sizes(x, residual, lower, upper))

    def sizes(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> Sizes:
        """The two of which :meth:`measure` is the larger. Collective."""
        at, r = self.system.rows.dofs, residual.array_r.copy()
        r[at] = projected(x.array_r[at], r[at], lower.array_r[at], upper.array_r[at])
        return self._sizes(r)

    def _sizes(self, r: Array) -> Sizes:
        nodal = float(np.max(np.abs(r[self.system.rows.dofs]) / self._allowed, initial=0.0))
        comm = self.system.comm
        norm = float(np.sqrt(comm.allreduce(float(r @ r)))) / self.system.scale
        return norm, float(comm.allreduce(nodal, op=MPI.MAX))

    def newton_step(self, x: PETSc.Vec, held: Entities, models: Sequence[Model], rtol: float) -> Outcome:
        """One Newton step with some dofs (local, owned) kept at their values in x. Collective."""
        self.system.set_rates(self.system.tangents(x, models))
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
        models: Sequence[Model],
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
            x: start and result. models: what stands for the laws, by term.
            tolerance: of :meth:`measure`. lower, upper: bounds.
            line_search: PETSc's name; ``bt`` uses the energy. max_iterations: Newton steps.
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

    def judged(self, step: Outcome, x: PETSc.Vec, models: Sequence[Model], tolerance: float) -> Outcome:
        """The outcome of a step without bounds: converged if the residual at x is small enough. Collective."""
        self.system.residual(x, self._residual, models)
        sizes = self._sizes(self._residual.array_r)
        found = replace(step, converged=max(sizes) <= tolerance, measure=max(sizes))
        return found if found.converged else self._to_rounding(found, sizes, x)

    def _to_rounding(self, found: Outcome, sizes: Sizes, x: PETSc.Vec) -> Outcome:
        """A residual that is but rounding can fall no further: the solve has converged as far as numbers go.

        Rounding of the body's forces is no excuse for a wrong traction on Γc: each of the two has its own floor.
        """
        if not np.isfinite(found.measure) or not np.isfinite(x.norm()) or found.measure > _LARGEST_ROUNDING:
            return found
        noise = self.system.load.duplicate()
        self.system.rounding(x, noise)
        floors = [_SAFETY * size for size in self._sizes(noise.array_r)]
        noise.destroy()
        if any(size > floor for size, floor in zip(sizes, floors, strict=True)):
            return found
        return replace(found, converged=True, rounding=max(floors), reason="as small as rounding allows")


class _Run:
    """The callbacks of one SNES solve."""

    def __init__(
        self, owner: ActiveSetSolver, models: Sequence[Model], tolerance: float, lower: PETSc.Vec, upper: PETSc.Vec
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
        snes.setJacobian(self._jacobian, _unextracted(self.owner.held))
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
        pc.setPythonContext(_ReducedPC(snes, self.owner.held, self._accuracy))
        return pc

    def _accuracy(self, *, moved: bool) -> float:
        """How far a linear solve goes: to the tolerance, but not for an active set that is still on the move."""
        if self.steady and not moved:
            return _STRAIGHT * self.tolerance / self.last
        return max(_INEXACT if moved else _FORCING * self.tolerance / self.last, _FINEST)

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
        system.set_rates(system.tangents(x, self.models))

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
        if not np.isfinite(self.last) or x.norm(PETSc.NormType.INFINITY) > _RUNAWAY:
            return PETSc.SNES.ConvergedReason.DIVERGED_FNORM_NAN
        if self.last <= self.tolerance:
            return PETSc.SNES.ConvergedReason.CONVERGED_FNORM_RELATIVE
        self._stalled = self._stalled + 1 if abs(self.last - previous) < _STILL * previous else 0
        self._slow = self._slow + 1 if self.last > 0.5 * previous else 0
        if self._stalled >= _PATIENCE or (self.last < _ROUNDING and self._slow >= 2 * _PATIENCE):
            return PETSc.SNES.ConvergedReason.DIVERGED_DTOL
        return PETSc.SNES.ConvergedReason.CONVERGED_ITERATING


def _unextracted(held: HeldPreconditioner) -> PETSc.Mat:
    """J as SNES VI sees it: its inactive part is multiplied at full size instead of being copied out."""
    sizes = held.system.matrix.getSizes()
    matrix = PETSc.Mat().createPython(sizes, _Whole(held), comm=held.system.comm)
    matrix.setUp()
    return matrix


class _Whole:
    """PETSc's view of J, which is symmetric."""

    def __init__(self, held: HeldPreconditioner) -> None:
        self._held = held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Y = J x, where a line search that fails looks for a stationary point of the residual's norm. Collective."""
        self._held.system.matrix.mult(x, y)

    multTranspose = mult

    def createSubMatrix(self, _: PETSc.Mat, rows: PETSc.IS, columns: PETSc.IS, into: PETSc.Mat | None) -> PETSc.Mat:
        """The rows and columns of the inactive dofs. Collective."""
        self._held.select(rows)
        sizes = (rows.getLocalSize(), rows.getSize())
        matrix = PETSc.Mat().createPython((sizes, sizes), _Reduced(self._held), comm=rows.comm)
        matrix.setUp()
        return matrix


class _Reduced:
    """PETSc's view of J on the inactive dofs of a step."""

    def __init__(self, held: HeldPreconditioner) -> None:
        self._held = held

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Y = J x. Collective."""
        self._held.multiply_reduced(x, y)


class _ReducedPC:
    """PETSc's view of :class:`HeldPreconditioner` on the inactive dofs of a SNES VI step."""

    def __init__(self, snes: PETSc.SNES, held: HeldPreconditioner, accuracy: Callable[..., float]) -> None:
        self._snes, self._held, self._accuracy = snes, held, accuracy
        self._active: Entities | None = None

    def setUp(self, pc: PETSc.PC) -> None:
        """Take the active dofs of this step and prepare for them."""
        start, end = self._held.system.load.owner_range
        active = np.ones(end - start, dtype=bool)
        active[self._snes.getVIInactiveSet().getIndices() - start] = False
        found = np.flatnonzero(active).astype(np.int32)
        moved = self._active is not None and not np.array_equal(found, self._active)
        moved = bool(self._held.system.comm.allreduce(moved))
        self._snes.getKSP().setTolerances(rtol=self._accuracy(moved=moved))
        self._active = found
        self._held.prepare(found)

    def apply(self, pc: PETSc.PC, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Y = P^-1 x on the inactive dofs."""
        self._held.apply_reduced(x, y)


def projected(x: Array, residual: Array, lower: Array, upper: Array) -> Array:
    """The residual less what the bounds may carry: zero exactly where the inequality holds; shape (n,)."""
    at_lower, at_upper = x <= lower + _ON_BOUND, x >= upper - _ON_BOUND
    r = np.where(at_lower, np.minimum(residual, 0.0), residual)
    return np.where(at_upper, np.maximum(r, 0.0), r)
