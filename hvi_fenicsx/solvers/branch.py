"""The exact branch iteration: a DC (difference of convex) algorithm for the unsmoothed inequality.

j = H - G; G is linearised at the current slips, the convex inequality that remains is solved, and so on
(majorisation-minimisation; Tao and An 1997). The true energy falls at each step; for piecewise laws the iteration ends
after finitely many changes of ξ ∈ ∂G. No Hessian is ever indefinite. Where G is curved (a smoothed law, slip weakening)
it converges linearly, so a Newton step with the true curvature is tried and kept if the energy does not rise.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..errors import SolverError
from ..laws import Superpotential
from ..system import boundedness
from ..typing import Array
from . import initial_branches, kink_bounds
from .active_set import Outcome
from .closed_start import resting_start
from .context import SolveContext
from .fallbacks import Attempt, first_success
from .law_models import Cells, Full, Majorant, SecantMajorant
from .method import Method
from .result import Counts, SolveResult

_SLIDES = "the body slides away on what is left of its bonds"
_ATTEMPTS = (
    (False, "basic", 30),
    (False, "bt", 60),
    (True, "bt", 40),
    (False, "basic", 30),
    (True, "bt", 200),
    (False, "bt", 60),
    (False, "basic", 30),
)
"""Of a convex step, until one converges: whether softened, PETSc's line search, most iterations."""


class BranchIteration(Method):
    """The iteration on one system; call :meth:`solve` once.

    Args:
        context: the system and how to solve it.
        laws: what stands for the system's laws (nondimensional), by default they themselves.
        epsilon: their relative width, for the progress display.
        check_bounded: whether to ask of each convex step first if it has a solution; else that is asked where a step
            fails.
    """

    name = "branch"
    words = "a branch iteration (DC) over SNES VI (reduced space)"
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
        self._check_bounded, self.thresholds = check_bounded, context.options.thresholds
        self.counts = Counts()
        self.energies: list[float] = []
        self._laws = [t.law for t in self.system.terms] if laws is None else list(laws)
        self._epsilon = context.epsilon if epsilon is None else epsilon
        self._residual = self.system.load.duplicate()

    def solve(self, start: PETSc.Vec | None = None, branches: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point. Collective.

        Args:
            start: where to begin; by default the resting start, which holds every rigid motion. Any other start must
                hold them too.
            branches: a displacement whose pieces of the laws to begin on; by default those of the options, which
                unless the user says otherwise are those of no slip, an unbroken bond, so that a vertex passes a drop
                only when the load drives it there.

        Raises:
            SolverError: a convex step did not lower the energy.
        """
        x = start.copy() if start is not None else self._resting()
        if branches is not None or start is not None:
            xi = self._subgradients(start if branches is None else branches, 0.0)
        else:
            first = initial_branches.arguments(self.system, x, self.options.start)
            xi = [law.concave.left(a) for law, a in zip(self._laws, first, strict=True)]
        with self.solver.reporting(self._progress):
            outcome = self._descend(x, self._cells(x), xi)
            while outcome.converged and (better := self._off_kinks(x)) is not None:
                better.copy(x)
        return self._result(x, outcome)

    def _resting(self) -> PETSc.Vec:
        x, linear = resting_start(self.solver, self._laws)
        self.counts.linear += linear
        return x

    def _progress(self, iteration: int, residual: float, contact: int) -> None:
        self.context.progress(self.label, self._epsilon, iteration, residual, contact)

    def _descend(self, x: PETSc.Vec, cells: list[Cells], xi: list[Array]) -> Outcome:
        """Convex steps from and into x until ξ stands. The first ξ may be that of another point."""
        outcome = Outcome(False, 0, 0, float("inf"), "no convex step")
        before = math.inf
        for _ in range(self.thresholds.convex_steps):
            cells, outcome, done = self._step(x, cells, xi)
            self._check_fall(before, outcome, x)
            before = self.energies[-1]
            if done:
                return outcome
            xi = self._subgradients(x, 0.0)
        return replace(outcome, converged=False, reason=f"ξ still changes after {self.thresholds.convex_steps} steps")

    def _off_kinks(self, x: PETSc.Vec) -> PETSc.Vec | None:
        """A point of lower energy, where x sits on a kink of G: both sides are tried (it hides a descent)."""
        near = self.thresholds.kink_distance
        on = [
            law.concave.left(a - near) < law.concave.right(a + near) - self._slack(law)
            for law, a in zip(self._laws, self._arguments(x), strict=True)
        ]
        if not self._any(on):
            return None
        energy = self._energy(x)
        for side in (-near, near):
            trial = x.copy()
            outcome = self._descend(trial, self._cells(trial), self._subgradients(trial, side))
            if outcome.converged and self._energy(trial) < energy - self._rounding(energy, x):
                return trial
        return None

    @staticmethod
    def _slack(law: Superpotential) -> float:
        """What G' may change within the distance of a kink without one."""
        return 1e-6 * law.traction_scale

    def _step(self, x: PETSc.Vec, cells: list[Cells], xi: list[Array]) -> tuple[list[Cells], Outcome, bool]:
        """One convex step, first to a loose tolerance, then, if ξ stands, to the wanted one."""
        if self._check_bounded and self._slides(xi):
            return cells, Outcome(False, 0, 0, math.inf, _SLIDES), True
        for tolerance in self._tolerances():
            cells, outcome = self._convex(x, cells, xi, tolerance)
            left = self._measure(x, cells, xi) if outcome.converged else math.inf
            if left > max(tolerance, outcome.rounding):
                break
        self.counts.branch += 1
        # where rounding ends a step, a ξ that lags behind may leave no more than rounding did
        allowed = max(self.options.tolerance, min(outcome.rounding, 2.0 * outcome.measure))
        stationary = outcome.converged and left <= allowed
        if stationary or not outcome.converged:
            return cells, outcome, True
        return cells, *self._accelerated(x, cells, outcome)

    def _tolerances(self) -> list[float]:
        """Of a convex step, one after the other: loose first, unless ξ is expected to stand."""
        wanted, loose = self.options.tolerance, self.thresholds.loose_tolerance
        return [wanted] if wanted >= loose or self._straight else [loose, wanted]

    @property
    def _straight(self) -> bool:
        return self.context.steady and self.counts.branch == 0

    def _convex(
        self, x: PETSc.Vec, cells: list[Cells], xi: list[Array], tolerance: float
    ) -> tuple[list[Cells], Outcome]:
        """Minimise the majorant over K, from and into x; cells change until no kink is overloaded."""
        for _ in range(self.thresholds.cell_changes):
            models = [Majorant(law, c, s) for law, c, s in zip(self._laws, cells, xi, strict=True)]
            outcome = self._bounded(x, models, cells, tolerance)
            self.system.residual(x, self._residual, models)
            moves = kink_bounds.overloaded(self.system, x, self._residual, models, self.options.tolerance)
            if not outcome.converged or not self._any(moves):
                return cells, outcome
            cells = [c.moved(m) for c, m in zip(cells, moves, strict=True)]
        return cells, replace(outcome, converged=False, reason="the states of the convex kinks keep changing")

    def _slides(self, xi: list[Array]) -> bool:
        """Whether the convex step has no solution."""
        return boundedness.is_unbounded(self.system.problem, self.system.forces, self._laws, xi, self.thresholds.linear)

    def _bounded(self, x: PETSc.Vec, models: Sequence[Majorant], cells: list[Cells], tolerance: float) -> Outcome:
        bounds, attempts = kink_bounds.boxes(self.system, cells), self._attempts(models)
        return first_success(self.solver, x, attempts, tolerance, bounds, self.counts)

    def _attempts(self, models: Sequence[Majorant]) -> Iterator[Attempt | str]:
        """Of a convex step; none after a failure, where it has no solution."""
        soft = [SecantMajorant(m, m.law.length_scale) for m in models]
        for softened, search, most in _ATTEMPTS:
            limit = min(most, self.options.max_iterations)
            yield Attempt(
                models=soft if softened else models,
                line_search=search,
                max_iterations=limit,
                kept=softened,
                steady=self._straight,
            )
            if not self._check_bounded:
                self._check_bounded = True
                if self._slides([m.xi for m in models]):
                    yield _SLIDES

    def _accelerated(self, x: PETSc.Vec, cells: list[Cells], outcome: Outcome) -> tuple[Outcome, bool]:
        """Newton with the true curvature where G is curved; dropped unless it ends lower and solves the inequality."""
        curved = [
            bool(np.any(law.concave.second(a) > 0)) for law, a in zip(self._laws, self._arguments(x), strict=True)
        ]
        if not self._any([np.array(curved)]):
            return outcome, False
        trial = x.copy()
        lower, upper = kink_bounds.boxes(self.system, cells)
        full = [Full(law, c) for law, c in zip(self._laws, cells, strict=True)]
        found = self.solver.solve(
            trial, full, self.options.tolerance, lower=lower, upper=upper, line_search="bt", max_iterations=15
        )
        self.counts.spend(found)
        if not found.converged or self._energy(trial) > self._energy(x) + self._rounding(self._energy(x), x):
            return outcome, False
        trial.copy(x)
        self.system.residual(x, self._residual, full)
        return found, not self._any(
            kink_bounds.overloaded(self.system, x, self._residual, full, self.options.tolerance)
        )

    def _measure(self, x: PETSc.Vec, cells: list[Cells], xi: list[Array]) -> float:
        """The residual of the true inequality: ξ stands if it is still in ∂G. Collective."""
        models = [
            Majorant(law, c, np.clip(s, law.concave.left(a), law.concave.right(a)))
            for law, c, s, a in zip(self._laws, cells, xi, self._arguments(x), strict=True)
        ]
        self.system.residual(x, self._residual, models)
        lower, upper = kink_bounds.boxes(self.system, cells)
        return self.solver.measure(x, self._residual, lower, upper)

    def _arguments(self, x: PETSc.Vec) -> list[Array]:
        return [t.argument(x.array_r) for t in self.system.terms]

    def _cells(self, x: PETSc.Vec) -> list[Cells]:
        terms = zip(self.system.terms, self._laws, self._arguments(x), strict=True)
        return [Cells.around(law.convex, a, radial=term.radial) for term, law, a in terms]

    def _subgradients(self, x: PETSc.Vec, shift: float) -> list[Array]:
        """ξ ∈ ∂G at the slips, which may be moved to one side of a kink."""
        return [law.concave.left(a + shift) for law, a in zip(self._laws, self._arguments(x), strict=True)]

    def _energy(self, x: PETSc.Vec) -> float:
        return self.system.energy(x, self._laws)  # type: ignore[arg-type]

    def _rounding(self, energy: float, x: PETSc.Vec) -> float:
        """What rounding may change of an energy: it is a difference of much larger numbers on stretched meshes."""
        return max(1e-10 * abs(energy), self.system.energy_rounding(x), 1e-300)

    def _check_fall(self, before: float, outcome: Outcome, x: PETSc.Vec) -> None:
        after = self._energy(x)
        self.energies.append(after)
        if outcome.converged and math.isfinite(before) and after > before + self._rounding(before, x):
            raise SolverError(f"a convex step raised the energy from {before:.12g} to {after:.12g}")

    def _any(self, flags: Sequence[npt.NDArray[np.generic]]) -> bool:
        return bool(self.system.comm.allreduce(any(bool(np.any(f)) for f in flags)))

    def _result(self, x: PETSc.Vec, outcome: Outcome) -> SolveResult:
        reason = "stationary" if outcome.converged else outcome.reason
        steady = self.counts.branch <= 1 and self.counts.newton <= len(self._tolerances())
        return SolveResult(
            u=self.system.displacement(x),
            method=self.label,
            converged=outcome.converged,
            reason=reason,
            counts=self.counts,
            energies=tuple(self.energies),
            interrupted=outcome.interrupted,
            steady=steady,
        )
