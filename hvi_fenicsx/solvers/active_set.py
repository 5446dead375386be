"""One smooth, bound-constrained solve by PETSc's reduced-space active-set Newton method (SNES VI, ``vinewtonrsls``).

To PETSc's own method it adds a convergence test on the residual of the inequality, and a preconditioner that works at
full size; beside it stand projected Newton steps with a line search.
"""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from petsc4py import PETSc
from scipy.optimize import brentq
from typing_extensions import override

from ..compat import NOT_A_NUMBER
from ..problem.references import strained
from ..runtime.cost import Timer
from ..runtime.mpi import largest
from ..system.equations import VertexModel
from ..system.held_solver import HeldPreconditioner, LinearSettings
from ..system.multigrid import Levels
from ..system.petsc_options import default_options, prefix, raise_python_error
from ..system.system import System
from ..typing import Array, Entities, Mask, magnitude
from .convergence import ConvergenceTest, Counts, Outcome, Sizes

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
Bounds = tuple[PETSc.Vec, PETSc.Vec]
"""Lower and upper ones."""


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One way to solve.

    Attributes:
        models: what takes the place of the laws, by term.
        exact: whether by projected steps with an exact line search; else by PETSc's full steps.
        start: where to begin instead; None for where it would.
        steady: whether the start's active set is expected to be the final one; the first linear solve is then exact.
    """

    models: Sequence[VertexModel]
    exact: bool = False
    start: PETSc.Vec | None = None
    steady: bool = False


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
        self.system, self.settings, self.timer, self.interrupted = system, settings, timer, interrupted
        self.held = HeldPreconditioner(system, levels, settings, timer)
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

    def newton_step(self, x: PETSc.Vec, held: Entities, models: Sequence[VertexModel], rtol: float) -> Outcome:
        """One Newton step that leaves some unknowns as they are. Collective.

        Args:
            x: start and result.
            held: the unknowns that stay (local, owned).
            models: what takes the place of the laws, by term.
            rtol: relative tolerance of the linear solve.
        """
        self.system.jacobian.set_rates(self.system.equations.tangents(x, models))
        self.system.equations.residual(x, self._residual, models)
        step, iterations, reason = self.held.solve_with(held, self._residual, rtol)
        finite = np.isfinite(step.norm())
        if finite:
            x.axpy(-1.0, step)
        return Outcome(reason > 0 and finite, 1, iterations, np.nan, f"KSP reason {reason}")

    def first_success(
        self,
        x: PETSc.Vec,
        attempts: Iterable[Attempt | str],
        tolerance: float,
        bounds: Bounds,
        counts: Counts,
        most: int,
    ) -> Outcome:
        """The outcome of the first attempt that converges, else of the one with the smallest residual. Collective.

        Args:
            x: start and result.
            attempts: the next is asked for only after the last has failed; a text is the reason to end.
            tolerance: of the residual's largest size.
            bounds: lower and upper bounds.
            counts: gets the iterations of all.
            most: Newton steps of each at most.
        """
        begin, best = x.copy(), x.copy()
        outcome = found = Outcome(False, 0, 0, np.inf, "not started")
        for attempt in attempts:
            if isinstance(attempt, str):
                outcome = replace(outcome, reason=attempt)
                break
            (begin if attempt.start is None else attempt.start).copy(x)
            x.copy(begin)
            found = self.solve(x, attempt, tolerance, bounds, most)
            counts.add_outcome(found)
            better = found.measure < outcome.measure or found.converged
            if better:
                x.copy(best)
            if better or outcome.measure == np.inf:
                outcome = found
            if found.converged or found.interrupted:
                break
            # an energy that has fallen is kept; else the next attempt begins where this one began
            if attempt.exact and np.isfinite(found.measure):
                x.copy(begin)
        best.copy(x)
        return replace(outcome, interrupted=found.interrupted)

    def solve(self, x: PETSc.Vec, attempt: Attempt, tolerance: float, bounds: Bounds, most: int) -> Outcome:
        """Minimise the energy of the models between the bounds. Collective.

        Args:
            x: start and result.
            attempt: how.
            tolerance: of the residual's largest size.
            bounds: lower and upper bounds.
            most: Newton steps at most.
        """
        with self.timer("solve"):
            if self._travels(x):
                self.system.evaluate_by_cells(x)
            run, coarse = _ProjectedRun if attempt.exact else _SnesRun, self.system.thresholds.coarse_tolerance
            found, left = run(self, attempt, tolerance, bounds, x).into(x, most), np.inf
            while tolerance < coarse and not found.interrupted and found.measure <= coarse:
                if found.converged and self._is_sure(found.measure, x, tolerance):
                    return found
                found, sizes = self._measured(found, x, attempt.models, tolerance, bounds)
                if found.converged or found.measure > 0.5 * left:
                    return self.convergence.accept_rounding(found, sizes, x, tolerance)
                left, again = found.measure, run(self, attempt, tolerance, bounds, x).into(x, most)
                found = replace(again, newton=found.newton + again.newton, linear=found.linear + again.linear)
            return found

    def _is_sure(self, measure: float, x: PETSc.Vec, tolerance: float) -> bool:
        """Whether products by the matrix tell the residual as well as forces by cells do. Collective."""
        return not self._travels(x) and measure + float(np.max(self.convergence.rounding(x))) <= tolerance

    def _travels(self, x: PETSc.Vec) -> bool:
        """Whether a body is far from where forces are known, which its rounding hides then. Collective."""
        u = self.system.displacement(self.system.equations.from_base(x))
        return strained(self.system.problem, u) is not u

    def judged(
        self, found: Outcome, x: PETSc.Vec, models: Sequence[VertexModel], tolerance: float, bounds: Bounds
    ) -> Outcome:
        """The outcome of a solve: converged if the residual at x is small, or as small as rounding allows. Collective.

        Args:
            found: of the solve.
            x: its result.
            models: what takes the place of the laws, by term.
            tolerance: of the residual's largest size.
            bounds: lower and upper bounds.
        """
        found, sizes = self._measured(found, x, models, tolerance, bounds)
        return self.convergence.accept_rounding(found, sizes, x, tolerance)

    def _measured(
        self, found: Outcome, x: PETSc.Vec, models: Sequence[VertexModel], tolerance: float, bounds: Bounds
    ) -> tuple[Outcome, Sizes]:
        self.system.evaluate_by_cells(x)
        self.system.equations.residual(x, self._residual, models)
        sizes = self.convergence.sizes(x, self._residual, *bounds)
        return replace(found, converged=sizes.worst <= tolerance, measure=sizes.worst), sizes


class _Run(ABC):
    """One solve: when it ends, and how."""

    _last = _least = np.inf
    _stood = _stopped = _far = False
    _useless, _reason = 0, ""

    def __init__(
        self, owner: ActiveSetSolver, attempt: Attempt, tolerance: float, bounds: Bounds, x: PETSc.Vec
    ) -> None:
        self._owner, self._attempt, self._tolerance, self._bounds = owner, attempt, tolerance, bounds
        self._start = x.array_r.copy()
        self._system, self._thresholds = owner.system, owner.system.thresholds

    @abstractmethod
    def into(self, x: PETSc.Vec, most: int) -> Outcome:
        """Run from and into x, so many steps at most. Collective."""

    def _outcome(self, steps: int, linear: int, reason: int) -> Outcome:
        left, name = np.inf if self._far or np.isnan(self._last) else self._last, _REASON.get(reason, "")
        words = self._reason or (f"{_WORDS[name]} ({name})" if name in _WORDS else name)
        if self._far:
            words = f"a displacement of more than {self._thresholds.runaway:.0e} times p0 L / E0"
        return Outcome(left <= self._tolerance, steps, linear, left, words, self._stopped)

    def _ends(self, iteration: int, x: PETSc.Vec, residual: PETSc.Vec) -> int:
        """Why to end, by the residual of the inequality or since it is in vain; 0: to go on. Collective."""
        owner, reasons = self._owner, PETSc.SNES.ConvergedReason
        before, self._last = self._last, owner.convergence.sizes(x, residual, *self._bounds).worst
        if owner.progress:
            owner.progress(iteration, self._last, owner.convergence.in_contact(x))
        self._far = largest(self._system.comm, magnitude(x.array_r - self._start)) > self._thresholds.runaway
        if self._last <= self._tolerance and not self._far:
            return reasons.CONVERGED_FNORM_RELATIVE
        self._stopped = owner.interrupted()
        if self._stopped:
            self._reason = "interrupted"
            return reasons.DIVERGED_FUNCTION_COUNT
        if (self._far and not self._attempt.exact) or not np.isfinite(self._last):
            return NOT_A_NUMBER
        return reasons.DIVERGED_DTOL if self._gives_up(before) else reasons.CONVERGED_ITERATING

    def _gives_up(self, before: float) -> bool:
        """Whether for long no step has halved the residual, or two in a row have not changed it.

        Full steps may go round in a circle for ever; those of a line search are of use where the energy falls, even if
        the residual does not.
        """
        small, stood, left = self._thresholds.coarse_tolerance, self._stood, self._last
        self._useless += 1
        if left < 0.5 * self._least:
            self._least, self._useless = left, 0
        self._stood = abs(left - before) < small * before
        counts = not self._attempt.exact or left < small
        return (stood and self._stood) or (counts and self._useless >= self._thresholds.few_steps)


class _SnesRun(_Run):
    """By PETSc's SNES: its convergence test, and the context of its matrix and of its linear solver.

    J's inactive part is not copied; its equations are solved at full size (:class:`.HeldPreconditioner`).
    """

    _active: Entities | None = None

    @override
    def into(self, x: PETSc.Vec, most: int) -> Outcome:
        self._snes = snes = self._configured(most)
        try:
            snes.solve(None, x)
        except PETSc.Error as error:
            raise_python_error(error)
            self._last, self._reason = np.inf, f"PETSc error {error.ierr}"
        finally:
            counts = snes.getIterationNumber(), snes.getLinearSolveIterations(), int(snes.getConvergedReason())
            snes.destroy()
        return self._outcome(*counts)

    def _configured(self, most: int) -> PETSc.SNES:
        system, attempt = self._system, self._attempt
        matrix = self._python_matrix(system.jacobian.matrix.getSizes())
        snes = PETSc.SNES().create(system.comm)
        snes.setType("vinewtonrsls")
        snes.setFunction(lambda _, x, f: system.equations.residual(x, f, attempt.models), system.load.duplicate())
        snes.setJacobian(self._set_tangent, matrix)
        snes.setVariableBounds(*self._bounds)
        snes.setConvergenceTest(lambda s, i, _: self._ends(i, s.getSolution(), s.getFunction()[0]))
        snes.setTolerances(max_it=most)
        near = self._thresholds.near * float(np.min(system.references.scale))
        ksp = snes.getKSP()
        with default_options({"snes_linesearch_type": "basic", "snes_vi_zero_tolerance": near}):
            snes.setOptionsPrefix(prefix())
            ksp.setOptionsPrefix(f"{prefix()}inactive_")  # the user's -ksp_type is for the one at full size
            snes.setFromOptions()
        ksp.getPC().setType(PETSc.PC.Type.NONE)
        ksp.setType(PETSc.KSP.Type.PYTHON)
        ksp.setPythonContext(self)
        return snes

    def _python_matrix(self, sizes: Any) -> PETSc.Mat:
        matrix = PETSc.Mat().createPython(sizes, self, comm=self._system.comm)
        matrix.setUp()
        return matrix

    def _set_tangent(self, snes: PETSc.SNES, x: PETSc.Vec, j: PETSc.Mat, p: PETSc.Mat) -> None:
        self._system.jacobian.set_rates(self._system.equations.tangents(x, self._attempt.models))

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, y: PETSc.Vec) -> None:
        """Multiply y = J x; PETSc asks where a residual is no number."""
        self._system.jacobian.matrix.mult(x, y)

    multTranspose = mult

    def createSubMatrix(self, _: PETSc.Mat, rows: PETSc.IS, columns: PETSc.IS, into: PETSc.Mat | None) -> PETSc.Mat:
        """The rows and columns of the inactive dofs, of which only the size is asked."""
        return self._python_matrix((rows.getLocalSize(), rows.getSize()))

    def solve(self, ksp: PETSc.KSP, load: PETSc.Vec, x: PETSc.Vec) -> None:
        """Solve J x = load on the inactive dofs: as exactly as the tolerance needs, or to tell an active set."""
        inactive, limits = self._snes.getVIInactiveSet(), self._thresholds
        least = 0.0 if self._attempt.steady else limits.coarse_tolerance
        goal = limits.margin**3 * self._tolerance / self._last
        moved = self._prepare(inactive)
        rtol = max(goal, limits.loose if moved else least)
        iterations, reason = self._owner.held.solve_reduced(inactive, load, x, rtol)
        ksp.setIterationNumber(iterations)
        ksp.setConvergedReason(reason)

    def _prepare(self, inactive: PETSc.IS) -> bool:
        """Prepare for the active dofs of this step; whether others were active in the last one. Collective."""
        active = np.ones(self._system.load.local_size, dtype=bool)
        active[inactive.getIndices() - self._system.load.owner_range[0]] = False
        found = np.flatnonzero(active).astype(np.int32)
        moved = self._active is not None and not np.array_equal(found, self._active)
        self._active = found
        self._owner.held.prepare(found)
        return bool(self._system.comm.allreduce(moved))


class _ProjectedRun(_Run):
    """By projected Newton steps (Bertsekas 1982), where a step as a whole leads off, and a shorter one nowhere.

    Unknowns at a bound that the residual pushes against are held. The path is projected onto the bounds, and is
    followed to where the slope of the energy is zero: beside large loads in balance energies are rounding, not so their
    slopes. Bodies share no force, so each has a length of its own.
    """

    _linear = 0

    @override
    def into(self, x: PETSc.Vec, most: int) -> Outcome:
        self._residual, reasons = self._system.load.duplicate(), PETSc.SNES.ConvergedReason
        self._move(x, x.array_r, 0.0)
        for steps in range(most + 1):
            self._system.equations.residual(x, self._residual, self._attempt.models)
            reason = self._ends(steps, x, self._residual)
            if reason or steps == most or not self._step(x):
                break
        left = reasons.DIVERGED_MAX_IT if steps == most else reasons.DIVERGED_LINE_SEARCH
        return self._outcome(steps, self._linear, reason or left)

    def _step(self, x: PETSc.Vec) -> bool:
        """One step from and into x, whose residual is known; whether there was any. Collective."""
        system, problem, limits = self._system, self._system.problem, self._thresholds
        system.jacobian.set_rates(system.equations.tangents(x, self._attempt.models, limits.foundation))
        right, (lower, upper) = -self._residual, (v.array_r for v in self._bounds)
        fixed = np.flatnonzero(self._at_bounds(x, right.array_r) | (lower >= upper)).astype(np.int32)
        step, linear, _ = self._owner.held.solve_with(fixed, right, limits.coarse_tolerance)
        self._linear += linear
        labels, moved = np.repeat(problem.bodies.labels[: x.local_size // problem.dimension], problem.dimension), 0.0
        for body in problem.bodies:
            direction = np.where(labels == body.index, step.array_r, 0.0)
            length = self._length(x, direction)
            self._move(x, direction, length)
            moved += length
        return moved > 0.0

    def _length(self, x: PETSc.Vec, direction: Array) -> float:
        """How far to where the slope of the energy along a projected direction is zero; 0: it rises. Collective."""

        def slope(length: float) -> float:
            there = x.copy()
            self._move(there, direction, length)
            self._system.equations.residual(there, self._residual, self._attempt.models)
            free = ~self._at_bounds(there, direction)
            return float(self._system.comm.allreduce(self._residual.array_r[free] @ direction[free]))

        if not slope(0.0) < 0.0:  # nor is it no number
            return 0.0
        far = 1.0
        while (falls := slope(far) < 0.0) and far < self._thresholds.runaway**2:
            far *= 2.0
        return far if falls else brentq(slope, 0.0, far, rtol=self._thresholds.coarse_tolerance)

    def _at_bounds(self, x: PETSc.Vec, direction: Array) -> Mask:
        """Which unknowns do not go in a direction, since they are at a bound."""
        u, (lower, upper) = x.array_r, (v.array_r for v in self._bounds)
        return ((u <= lower) & (direction < 0.0)) | ((u >= upper) & (direction > 0.0))

    def _move(self, x: PETSc.Vec, direction: Array, length: float) -> None:
        """Along a direction, projected onto the bounds."""
        x.array[:] = np.clip(x.array_r + length * direction, *(v.array_r for v in self._bounds))
