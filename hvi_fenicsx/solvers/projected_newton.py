"""Newton's method on bounds with a line search on the slope of the energy, where the energy itself is only rounding.

Beside large loads in balance, weak laws change the energy by less than its rounding error, so no line search on
energies can tell a good step. The slope along a step is a product with the residual, in which the balanced loads cancel
first. The steps are those of projected Newton methods (Bertsekas 1982): unknowns at a bound that the residual pushes
against are held, the path is projected onto the bounds, and it is followed to where the slope changes its sign. A
foundation keeps the matrix regular where laws have no stiffness; the line search goes on to where they begin to resist.
Bodies share no force, so each has a line search of its own: the energy of one is rounding beside that of another.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from ..system.equations import LawModel
from ..system.held_solver import Goal
from ..typing import Array
from .active_set import ActiveSetSolver
from .convergence import Outcome
from .method import Counts
from .thresholds import ENERGY, EXACT, Thresholds

_DIGITS = int(np.finfo(np.float64).nmant)
"""Halvings or doublings of a length, at most: then its digits are used up."""


class ProjectedNewton:
    """The method for some models in the place of the laws.

    Args:
        solver: its system, its preconditioner and its test of convergence.
        models: what takes the place of the laws, by term.
        lower: lower bounds.
        upper: upper bounds.
    """

    def __init__(self, solver: ActiveSetSolver, models: Sequence[LawModel], lower: PETSc.Vec, upper: PETSc.Vec) -> None:
        self._solver, self._system, self._models = solver, solver.system, models
        self._lower, self._upper = lower, upper
        self._thresholds: Thresholds = solver.thresholds
        self._residual, self._trial = self._system.load.duplicate(), self._system.load.duplicate()
        self._linear = 0
        bodies, d = self._system.problem.bodies, self._system.problem.scales.dimension
        self._bodies = len(bodies.bodies)
        self._labels = np.repeat(bodies.labels[: self._residual.local_size // d], d)

    def solve(self, x: PETSc.Vec, tolerance: float, max_iterations: int) -> Outcome:
        """Minimise the energy of the models between the bounds. Collective.

        Args:
            x: start and result.
            tolerance: of the residual of the inequality.
            max_iterations: steps at most.
        """
        self._project(x)
        with self._solver.timer("solve"):
            outcome = self._iterate(x, tolerance, max_iterations)
        for vector in (self._residual, self._trial):
            vector.destroy()
        return outcome

    def _iterate(self, x: PETSc.Vec, tolerance: float, most: int) -> Outcome:
        test, reason, stopped = self._solver.convergence, "no steps left", False
        best, stalled = np.inf, 0
        for iteration in range(most + 1):
            self._system.equations.residual(x, self._residual, self._models)
            sizes = test.sizes(x, self._residual, self._lower, self._upper)
            if self._solver.progress:
                self._solver.progress(iteration, sizes.worst, self._solver.in_contact(x))
            if sizes.worst <= tolerance:
                reason = "the residual is small"
                break
            stopped = self._solver.interrupted()
            if stopped:
                reason = "interrupted"
                break
            stalled = 0 if sizes.worst < 0.5 * best else stalled + 1
            best = min(best, sizes.worst)
            if stalled > self._thresholds.useless_steps:
                reason = "the residual no longer falls"
                break
            if iteration == most or not self._step(x):
                reason = reason if iteration == most else "no step lowers the energy"
                break
        found = Outcome(sizes.worst <= tolerance, iteration, self._linear, sizes.worst, reason, stopped)
        return found if found.converged or stopped else test.accept_rounding(found, sizes, x)

    def _step(self, x: PETSc.Vec) -> bool:
        """One step from and into x, whose residual is known; whether there was any. Collective."""
        step = self._newton_step(x)
        finite = bool(np.isfinite(step.norm()))
        lengths = self._lengths(x, step) if finite else np.zeros(1)
        moves = bool(np.any(lengths > 0.0))
        if moves:
            self._along(x, step, lengths).copy(x)
        step.destroy()
        return moves

    def _newton_step(self, x: PETSc.Vec) -> PETSc.Vec:
        system, held = self._system, self._solver.held
        system.jacobian.set_rates(system.equations.tangents(x, self._models, self._thresholds.foundation))
        at, r = system.jacobian.rows.dofs, self._residual.array_r
        low, high, u = (v.array_r[at] for v in (self._lower, self._upper, x))
        pushed = ((u <= low) & (r[at] > 0.0)) | ((u >= high) & (r[at] < 0.0)) | (low >= high)
        fixed = np.unique(at[pushed]).astype(np.int32)
        right, step = self._residual.copy(), x.duplicate()
        right.scale(-1.0)
        right.array[fixed] = 0.0
        step.set(0.0)
        held.prepare(fixed)
        self._linear += held.solve(right, step, Goal(rtol=self._thresholds.coarse_tolerance))[0]
        step.array[fixed] = 0.0
        right.destroy()
        return step

    def _lengths(self, x: PETSc.Vec, step: PETSc.Vec) -> Array:
        """Where the slope along the projected step changes its sign, by body; 0 where it does not fall. Collective."""
        begin: Array = np.zeros(self._bodies)
        end: Array = np.ones(self._bodies)
        behind, ahead = self._slopes(x, step, begin), self._slopes(x, step, end)
        flat = -self._thresholds.flat * behind
        falls = behind < 0.0
        for _ in range(_DIGITS):
            if not np.any(onward := falls & (ahead < -flat)):
                break
            begin, behind = np.where(onward, end, begin), np.where(onward, ahead, behind)
            end = np.where(onward, 2.0 * end, end)
            ahead = self._slopes(x, step, end)
        return self._zeros(x, step, (begin, end), (behind, ahead), flat)

    def _zeros(
        self, x: PETSc.Vec, step: PETSc.Vec, ends: tuple[Array, Array], slopes: tuple[Array, Array], flat: Array
    ) -> Array:
        """Where between two lengths the slope is at most ``flat``, by body; 0 where that is negative. Collective."""
        (begin, end), (behind, ahead) = ends, slopes
        found = np.where(flat > 0.0, end, 0.0)
        left = (flat > 0.0) & (np.abs(ahead) > flat) & (ahead > 0.0)
        for _ in range(_DIGITS):
            if not np.any(left):
                break
            middle = np.where(left, self._between(begin, end, behind, ahead), found)
            slope = self._slopes(x, step, middle)
            found = middle
            left = left & (np.abs(slope) > flat)
            falls, rises = left & (slope < 0.0), left & (slope > 0.0)
            begin, behind = np.where(falls, middle, begin), np.where(falls, slope, behind)
            end, ahead = np.where(rises, middle, end), np.where(rises, slope, ahead)
        return found

    def _between(self, begin: Array, end: Array, behind: Array, ahead: Array) -> Array:
        """Where a straight line between two slopes is zero, but not too near to the beginning."""
        rise = ahead - behind
        share = np.divide(-behind, rise, out=np.full_like(rise, 0.5), where=rise > 0.0)
        return np.asarray(begin + np.clip(share, self._thresholds.flat, 0.5) * (end - begin))

    def _slopes(self, x: PETSc.Vec, step: PETSc.Vec, lengths: Array) -> Array:
        """The slopes of the energy along the projected path from x, by body: they share no force. Collective."""
        there = self._along(x, step, lengths)
        self._system.equations.residual(there, self._residual, self._models)
        u, d = there.array_r, step.array_r
        stopped = ((u <= self._lower.array_r) & (d < 0.0)) | ((u >= self._upper.array_r) & (d > 0.0))
        works = self._residual.array_r * np.where(stopped, 0.0, d)
        found = np.bincount(self._labels, weights=works, minlength=self._bodies)
        return np.asarray(self._system.comm.allreduce(found))

    def _along(self, x: PETSc.Vec, step: PETSc.Vec, lengths: Array) -> PETSc.Vec:
        self._trial.array[:] = x.array_r + lengths[self._labels] * step.array_r
        self._project(self._trial)
        return self._trial

    def _project(self, x: PETSc.Vec) -> None:
        values: Array = np.clip(x.array_r, self._lower.array_r, self._upper.array_r)
        x.array[:] = values


@dataclass(frozen=True, kw_only=True)
class Attempt:
    """One way to solve a step.

    Attributes:
        models: what takes the place of the laws, by term.
        line_search: PETSc's name, or that of the projected Newton method.
        start: where to begin instead; None for where it would.
        steady: as in :meth:`.ActiveSetSolver.solve`.
        foundation: likewise.
    """

    models: Sequence[LawModel]
    line_search: str
    start: PETSc.Vec | None = None
    steady: bool = False
    foundation: float = 0.0


def first_success(
    solver: ActiveSetSolver,
    x: PETSc.Vec,
    attempts: Iterable[Attempt | str],
    tolerance: float,
    bounds: tuple[PETSc.Vec, PETSc.Vec],
    counts: Counts,
    most: int,
) -> Outcome:
    """The outcome of the first attempt that converges, else of the one with the smallest residual. Collective.

    Args:
        solver: of all attempts.
        x: start and result.
        attempts: the next is asked for only after the last has failed; a text instead of one is the reason to end.
        tolerance: as in :meth:`.ActiveSetSolver.solve`.
        bounds: lower and upper bounds.
        counts: gets the iterations of all.
        most: Newton steps of each at most.
    """
    begin, best = x.copy(), x.copy()
    outcome = found = Outcome(False, 0, 0, float("inf"), "not started")
    for attempt in attempts:
        if isinstance(attempt, str):
            outcome = replace(outcome, reason=attempt)
            break
        if attempt.start is not None:
            attempt.start.copy(begin)
        begin.copy(x)
        found = _solve(solver, x, attempt, tolerance, bounds, most)
        counts.add_outcome(found)
        if found.measure < outcome.measure or found.converged:
            outcome = found
            x.copy(best)
        if found.converged or found.interrupted:
            break
        # an energy that has fallen is kept; else the next attempt begins where this one began
        if attempt.line_search == ENERGY and np.isfinite(found.measure):
            x.copy(begin)
    best.copy(x)
    for vector in (begin, best):
        vector.destroy()
    return replace(outcome, interrupted=found.interrupted)


def _solve(
    solver: ActiveSetSolver,
    x: PETSc.Vec,
    attempt: Attempt,
    tolerance: float,
    bounds: tuple[PETSc.Vec, PETSc.Vec],
    most: int,
) -> Outcome:
    """How one attempt ends, from and into x. Collective."""
    if attempt.line_search == EXACT:
        return ProjectedNewton(solver, attempt.models, *bounds).solve(x, tolerance, most)
    return solver.solve(
        x,
        attempt.models,
        tolerance,
        lower=bounds[0],
        upper=bounds[1],
        line_search=attempt.line_search,
        max_iterations=most,
        steady=attempt.steady,
        foundation=attempt.foundation,
    )
