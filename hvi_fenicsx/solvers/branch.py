"""The exact branch iteration: a DC (difference of convex) algorithm for the unsmoothed inequality.

j = H - G; G is linearised at the current slips, the inequality that remains is solved (:mod:`.convex_step`), and so on
(majorisation-minimisation; Tao and An 1997). The true energy falls at each step. Of a signed slip that inequality is
convex; of |u_t| in 3D only where ξ ≤ H'. If the law falls by jumps alone, the iteration ends after finitely many
changes of ξ ∈ ∂G. Where G has slopes (a falling part, a smoothed law, slip weakening) it converges linearly, so a
Newton step with the true curvature is tried and kept if the energy does not rise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from ..effects import Direction
from ..errors import SolverError
from ..formula import Formula
from ..laws import Superpotential
from ..model.content import Start
from ..system.equations import Cells
from ..system.system import System
from ..typing import Array
from .convergence import Counts, Outcome
from .convex_step import UNBOUNDED, ConvexStep, no_step
from .method import Method, SolveContext, SolveResult
from .resting_start import resting_start


class BranchIteration(Method):
    """The iteration on one system; call :meth:`solve` once.

    Args:
        context: the system and how to solve it.
        laws: what is solved in the place of the system's laws (nondimensional); by default the laws themselves.
        epsilon: their relative width, for the progress display.
        check_bounded: whether to ask before each convex step if it has a solution; else only where a step fails.
    """

    name = "branch"
    description = "a branch iteration (DC) over SNES VI (reduced space)"
    takes_start = True
    takes_smoothing = False

    def __init__(
        self,
        context: SolveContext,
        laws: Sequence[Superpotential] | None = None,
        epsilon: float | None = None,
        *,
        check_bounded: bool = False,
    ) -> None:
        super().__init__(context)
        self.thresholds, self.counts = context.system.thresholds, Counts()
        self.energies: list[float] = []
        self._laws = [t.law for t in self.system.terms] if laws is None else list(laws)
        self._epsilon = context.epsilon if epsilon is None else epsilon
        self._convex = ConvexStep(context, self._laws, self.counts, check_bounded=check_bounded)

    def solve(self, start: PETSc.Vec | None = None, branches: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point. Collective.

        Args:
            start: where to begin; by default the resting start. Another one must be near to where contact and laws
                hold the bodies.
            branches: a displacement that says on which pieces of the laws to begin; by default those of the options,
                which unless the user says otherwise are those of no slip, an unbroken bond, so that a vertex passes a
                drop only when the load drives it there.

        Raises:
            SolverError: a convex step did not lower the energy.
        """
        if start is None:
            x, linear = resting_start(self.solver, self._laws)
            self.counts.linear += linear
        else:
            x = start.copy()
        xi = self._first_subgradients(x, start if branches is None else branches)
        with self.solver.reporting(self._progress):
            outcome = self._descend(x, self._convex.cells(x), xi)
            while outcome.converged and (better := self._off_kinks(x)) is not None:
                better.copy(x)
        return self._result(x, outcome)

    def newton(self, start: PETSc.Vec, drops: Sequence[Array] | None = None) -> SolveResult:
        """A stationary point near a start by Newton's method on the laws themselves, perhaps no minimum. Collective.

        Args:
            start: where to begin.
            drops: kinks of G on which vertices are held, NaN where they are not, by term; None: none is held.
        """
        x = start.copy()
        with self.solver.reporting(self._progress):
            outcome, stationary = self._convex.newton(x, self._convex.cells(x), drops)
        return self._result(x, replace(outcome, converged=stationary))

    def _first_subgradients(self, x: PETSc.Vec, branches: PETSc.Vec | None) -> list[Array]:
        """ξ of the pieces to begin on: those of a displacement, or those of the options."""
        if branches is not None:
            return self._convex.subgradients(branches)
        first = arguments(self.system, x, self.options.start, self.thresholds.runaway)
        return [law.concave.left(a) for law, a in zip(self._laws, first, strict=True)]

    def _progress(self, iteration: int, residual: float, contact: int) -> None:
        self.context.tell(self.label, self._epsilon, iteration, residual, contact)

    def _descend(self, x: PETSc.Vec, cells: list[Cells], xi: list[Array]) -> Outcome:
        """Convex steps from and into x until ξ no longer changes. The first ξ may be that of another point."""
        outcome, before = no_step(), math.inf
        for _ in range(self.thresholds.most_changes):
            cells, outcome, done = self._step(x, cells, xi)
            self._check_fall(before, outcome, x)
            before = self.energies[-1]
            if done:
                return outcome
            xi = self._convex.subgradients(x)
        return replace(outcome, converged=False, reason=f"ξ still changes after {self.thresholds.most_changes} steps")

    def _off_kinks(self, x: PETSc.Vec) -> PETSc.Vec | None:
        """A point of lower energy, where x is on a kink of G, which hides a descent: both sides are tried."""
        distance, references = self.thresholds.near, self.system.references
        near = [t.reach(distance * references.at(t.surface.blocks)) for t in self.system.terms]
        on = [
            np.abs(a[:, None] - law.concave.kinks) <= d[:, None]
            for law, a, d in zip(self._laws, self._convex.arguments(x), near, strict=True)
        ]
        if not self._convex.anywhere(on):
            return None
        energy = self._convex.energy(x)
        for side in (-1.0, 1.0):
            trial, shifts = x.copy(), [side * d for d in near]
            outcome = self._descend(trial, self._convex.cells(trial), self._convex.subgradients(trial, shifts))
            if outcome.converged and self._convex.energy(trial) < energy - self._convex.energy_rounding(energy, x):
                return trial
        return None

    def _step(self, x: PETSc.Vec, cells: list[Cells], xi: list[Array]) -> tuple[list[Cells], Outcome, bool]:
        """One convex step, first to a loose tolerance, then, if ξ does not change, to the wanted one."""
        if self._convex.known_unbounded(xi):
            return cells, replace(no_step(), reason=UNBOUNDED), True
        for tolerance in self._tolerances():
            cells, outcome = self._convex.minimise(x, cells, xi, tolerance, steady=self._straight)
            left = self._convex.measure_step(x, cells, xi, outcome) if outcome.converged else math.inf
            if left > max(tolerance, outcome.rounding):
                break
        self.counts.branch += 1
        # where rounding ends a step, a ξ that lags behind may leave no more than rounding did
        allowed = max(self.options.tolerance, min(outcome.rounding, 2.0 * outcome.measure))
        stationary = outcome.converged and left <= allowed
        if stationary or not outcome.converged:
            return cells, outcome, True
        return cells, *self._convex.accelerate(x, cells, outcome)

    def _tolerances(self) -> list[float]:
        """Tolerances of a convex step, one after the other: loose first, unless ξ is expected not to change."""
        wanted, loose = self.options.tolerance, self.thresholds.coarse_tolerance
        return [wanted] if wanted >= loose or self._straight else [loose, wanted]

    @property
    def _straight(self) -> bool:
        return self.context.steady and self.counts.branch == 0

    def _check_fall(self, before: float, outcome: Outcome, x: PETSc.Vec) -> None:
        after = self._convex.energy(x)
        self.energies.append(after)
        if not outcome.converged or not math.isfinite(before):
            return
        if after > before + self._convex.energy_rounding(before, x):
            raise SolverError(f"a convex step raised the energy from {before:.12g} to {after:.12g}")

    def _result(self, x: PETSc.Vec, outcome: Outcome) -> SolveResult:
        steady = self.counts.branch <= 1 and self.counts.newton <= len(self._tolerances())
        return self.result(x, outcome, self.counts, energies=tuple(self.energies), steady=steady)


def arguments(system: System, resting: PETSc.Vec, start: Start, broken_slip: float) -> list[Array]:
    """Arguments of the laws on the pieces to begin on, by term, (m,) each.

    Args:
        system: the assembled problem.
        resting: the displacement with contact closed and laws at rest.
        start: the name of a start, or a displacement by component (m).
        broken_slip: slip of a broken bond, relative to the law's length or to the slip at rest.
    """
    if start == "unbroken":
        return [np.zeros(len(t.surface.blocks)) for t in system.terms]
    if not isinstance(start, str):
        return _displaced(system, start)
    found = [t.argument(resting.array_r) for t in system.terms]
    if start == "broken":  # a large slip in the direction of that at rest; positive for an opening or a penetration
        for slip, term in zip(found, system.terms, strict=True):
            sign = np.where((slip < 0) & (term.direction is Direction.SLIP), -1.0, 1.0)
            slip[:] = sign * broken_slip * np.maximum(np.abs(slip), term.exact.length_scale)
    return found


def _displaced(system: System, start: Sequence[Formula]) -> list[Array]:
    """Arguments of a displacement; the directions of the problem's own terms are Cartesian, as it is."""
    found = []
    for term in system.problem.terms:
        u = np.column_stack([f.at(term.surface.points) for f in start]) / system.problem.scales.displacement
        found.append(term.argument_of(np.einsum("mkd,md->mk", term.directions, u)))
    return found
