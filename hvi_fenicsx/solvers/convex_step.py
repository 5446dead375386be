"""One convex step of the branch iteration: the inequality that remains when G is linearised at ξ ∈ ∂G.

The kinks of H stay in the step: each vertex is kept in a cell between two kinks, and changes its cell until no kink is
overloaded. Where a step fails, it is asked whether it has a minimiser at all, and another line search is tried.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from petsc4py import PETSc

from ..laws import Superpotential
from ..laws.base import Directional
from ..problem.scaling import DEFAULT
from ..rigid import gives_way
from ..system import existence
from ..system.equations import Cells, VertexModel
from ..system.system import System
from ..typing import Array
from . import kink_bounds
from .active_set import Attempt
from .convergence import Counts, Outcome
from .method import SolveContext
from .resting_start import at_rest

UNBOUNDED = "the body slides away on what is left of its bonds"


class ConvexStep:
    """Convex steps on one system.

    Args:
        context: the system and how to solve it.
        laws: what is solved in the place of the system's laws, by term (nondimensional).
        counts: gets the iterations.
        check_bounded: whether to ask before each step if it has a solution; else only where a step fails.
    """

    def __init__(
        self, context: SolveContext, laws: Sequence[Superpotential], counts: Counts, *, check_bounded: bool
    ) -> None:
        self._system, self._solver = context.system, context.solver
        self._laws, self._counts, self._check_bounded = laws, counts, check_bounded
        self._options, self._thresholds = context.options, context.system.thresholds
        self._residual = context.system.load.duplicate()

    def arguments(self, x: PETSc.Vec) -> list[Array]:
        """What the laws act on at x, by term, (m,) each."""
        return [t.argument(x.array_r) for t in self._system.terms]

    def cells(self, x: PETSc.Vec) -> list[Cells]:
        """The cells between convex kinks that hold x, by term."""
        terms = zip(self._system.terms, self._laws, self.arguments(x), strict=True)
        return [Cells.around(law.convex, a, radial=t.radial) for t, law, a in terms]

    def subgradients(self, x: PETSc.Vec, shifts: Sequence[Array] | None = None) -> list[Array]:
        """ξ ∈ ∂G at x, by term, (m,) each.

        Args:
            x: the displacement.
            shifts: of the arguments, to one side of a kink, by term, (m,) each; None: none.
        """
        arguments = self.arguments(x)
        moved = arguments if shifts is None else [a + s for a, s in zip(arguments, shifts, strict=True)]
        return [law.concave.left(a) for law, a in zip(self._laws, moved, strict=True)]

    def majorants(self, cells: Sequence[Cells], xi: Sequence[Array]) -> list[VertexModel]:
        """H - ξ, by term.

        Args:
            cells: where each vertex is kept, by term.
            xi: ξ by term, (m,) each.
        """
        return [VertexModel(law, c, s) for law, c, s in zip(self._laws, cells, xi, strict=True)]

    def energy(self, x: PETSc.Vec) -> float:
        """The true energy at x. Collective."""
        return self._system.equations.energy(x, self._laws)  # type: ignore[arg-type]

    def energy_rounding(self, energy: float, x: PETSc.Vec) -> float:
        """By how much rounding may change an energy: on stretched meshes it is a difference of much larger numbers.

        Args:
            energy: at x.
            x: the displacement.
        """
        return max(self._thresholds.energy_rounding * abs(energy), self._system.equations.energy_rounding(x), 1e-300)

    def anywhere(self, flags: Sequence[npt.NDArray[np.generic]]) -> bool:
        """Whether any flag is set, on any rank. Collective."""
        return bool(self._system.comm.allreduce(any(bool(np.any(f)) for f in flags)))

    def known_unbounded(self, xi: Sequence[Array]) -> bool:
        """Whether the step has no solution, where that is to be asked before a step. Collective."""
        return self._check_bounded and is_unbounded(self._system, self._laws, xi)

    def minimise(
        self, x: PETSc.Vec, cells: list[Cells], xi: Sequence[Array], tolerance: float, *, steady: bool
    ) -> tuple[list[Cells], Outcome]:
        """Minimise the majorant within the bounds; cells change until no kink is overloaded. Collective.

        Args:
            x: start and result.
            cells: where each vertex is kept at first, by term.
            xi: ξ by term, (m,) each.
            tolerance: of the residual.
            steady: whether x's active set is expected to be the final one.

        Returns:
            The cells at the end, and how it ended.
        """
        most = self._options.max_iterations
        for _ in range(self._thresholds.most_changes):
            models = self.majorants(cells, xi)
            bounds, attempts = kink_bounds.slip_bounds(self._system, cells), self._attempts(models, steady=steady)
            outcome = self._solver.first_success(x, attempts, tolerance, bounds, self._counts, most)
            moves = self._overloaded(x, models)
            if not outcome.converged or not self.anywhere(moves):
                return cells, outcome
            cells = [c.moved(m) for c, m in zip(cells, moves, strict=True)]
        return cells, replace(outcome, converged=False, reason="the states of the convex kinks keep changing")

    def measure(self, x: PETSc.Vec, cells: Sequence[Cells], xi: Sequence[Array]) -> float:
        """The residual of the true inequality: small if ξ is still in ∂G; infinite on an overloaded kink. Collective.

        Args:
            x: the displacement.
            cells: where each vertex is kept, by term.
            xi: ξ by term, (m,) each.
        """
        if self.anywhere(self._overloaded(x, self.majorants(cells, self._nearest(x, xi)))):
            return math.inf
        lower, upper = kink_bounds.slip_bounds(self._system, cells)
        return self._solver.convergence.sizes(x, self._residual, lower, upper).worst

    def measure_step(self, x: PETSc.Vec, cells: Sequence[Cells], xi: Sequence[Array], outcome: Outcome) -> float:
        """As :meth:`measure`, after a step with these ξ: where all are still in ∂G, its own residual. Collective.

        Args:
            x: the displacement.
            cells: where each vertex is kept, by term.
            xi: ξ by term, (m,) each.
            outcome: of the step that led to x.
        """
        changed = [near != s for near, s in zip(self._nearest(x, xi), xi, strict=True)]
        return self.measure(x, cells, xi) if self.anywhere(changed) else outcome.measure

    def _nearest(self, x: PETSc.Vec, xi: Sequence[Array]) -> list[Array]:
        """The elements of ∂G at x that are nearest to ξ, by term."""
        arguments = zip(self._laws, xi, self.arguments(x), strict=True)
        return [np.clip(s, law.concave.left(a), law.concave.right(a)) for law, s, a in arguments]

    def accelerate(self, x: PETSc.Vec, cells: Sequence[Cells], outcome: Outcome) -> tuple[Outcome, bool]:
        """Newton steps with the true curvature, where G is curved. Collective.

        They are dropped unless they end at no higher energy and solve the inequality.

        Args:
            x: start and result.
            cells: where each vertex is kept, by term.
            outcome: of the convex step that led to x.

        Returns:
            How it ended, and whether x is stationary.
        """
        arguments = zip(self._laws, self.arguments(x), strict=True)
        if not self.anywhere([law.concave.second(a) > 0 for law, a in arguments]):
            return outcome, False
        trial = x.copy()
        found, stationary = self.newton(trial, cells)
        if not found.converged or self.energy(trial) > self.energy(x) + self.energy_rounding(self.energy(x), x):
            return outcome, False
        trial.copy(x)
        return found, stationary

    def newton(
        self, x: PETSc.Vec, cells: Sequence[Cells], drops: Sequence[Array] | None = None
    ) -> tuple[Outcome, bool]:
        """Newton steps on the laws themselves, whole ones, each vertex kept in its cell. Collective.

        Near a solution a line search on the energy would see no more than its rounding.

        Args:
            x: start and result.
            cells: where each vertex is kept, by term.
            drops: kinks of G on which vertices are held, NaN where they are not, by term, (m,) each.

        Returns:
            How it ended, and whether x is stationary.
        """
        bounds = kink_bounds.slip_bounds(self._system, cells)
        if drops is not None:
            bounds = kink_bounds.held_on(self._system.terms, bounds, drops)
        exact = [VertexModel(law, c) for law, c in zip(self._laws, cells, strict=True)]
        most = 2 * self._thresholds.few_steps
        found = self._solver.solve(x, Attempt(models=exact), self._options.tolerance, bounds, most)
        self._counts.add_outcome(found)
        if drops is None or not found.converged:
            return found, found.converged and not self.anywhere(self._overloaded(x, exact))
        return found, self.measure(x, cells, self._carried(x, exact, drops)) <= self._options.tolerance

    def _carried(self, x: PETSc.Vec, exact: Sequence[VertexModel], drops: Sequence[Array]) -> list[Array]:
        """The ξ that balance what holds vertices on drops, by term, (m,) each."""
        self._system.equations.residual(x, self._residual, exact)
        found = []
        for term, model, at, a in zip(self._system.terms, exact, drops, self.arguments(x), strict=True):
            middle = (model.law.concave.left(a) + model.law.concave.right(a)) / 2
            force = np.einsum("md,md->m", term.directions[:, 0, :], term.surface.values(self._residual.array_r))
            held = np.isfinite(at) & (not term.radial)
            found.append(middle + np.divide(force, term.weights, out=np.zeros_like(force), where=held))
        return found

    def _overloaded(self, x: PETSc.Vec, models: Sequence[VertexModel]) -> list[npt.NDArray[np.int64]]:
        """To which cell each vertex moves whose kink cannot carry its force, by term."""
        self._system.equations.residual(x, self._residual, models)
        slack = self._thresholds.margin * self._options.tolerance
        return kink_bounds.overloaded(self._system, x, self._residual, models, slack)

    def _attempts(self, models: Sequence[VertexModel], *, steady: bool) -> Iterator[Attempt | str]:
        """Ways to solve the step; after the first failure a reason instead, where it has no solution."""
        yield Attempt(models=models, steady=steady)
        if not self._check_bounded:
            self._check_bounded = True
            if is_unbounded(self._system, self._laws, [m.xi for m in models if m.xi is not None]):
                yield UNBOUNDED
        if is_quadratic(self._system) and (rested := at_rest(self._solver, self._laws)) is not None:
            self._counts.linear += rested[1]
            yield Attempt(models=models, start=rested[0])
        yield Attempt(models=models, exact=True)
        yield Attempt(models=models)


def is_quadratic(system: System) -> bool:
    """Whether the energy is quadratic: laws that are linear springs at most. The same on all ranks."""
    return all(term.is_linear for term in system.terms)


def no_step() -> Outcome:
    """The outcome before the first step."""
    return Outcome(False, 0, 0, math.inf, "no convex step")


def is_unbounded(system: System, laws: Sequence[Superpotential], xi: Sequence[Array]) -> bool:
    """Whether the convex energy with H - ξ in the place of each law j = H - G has no minimiser. Collective.

    It has none where the load does more work than ∫ H^∞(y) - ξ·y along a rigid motion y that contact admits: the body
    slides away, its remaining bonds do not hold it. Work that is equal within rounding is no proof of that.

    For a law of |u_t|, ξ reduces the weights of the vertices. One whose law falls below zero pushes the body on, and
    counts as no resistance: the functional stays convex, and a body that slides away in spite of it does so all the
    more.

    Args:
        system: the assembled problem.
        laws: what is solved, by term.
        xi: ξ at the vertices, by term, (m,) each.
    """
    problem = system.problem
    for whole in existence.rigid_problems(problem, system.forces):
        acting = [existence.acts_on(problem, whole.body, term.surface) for term in problem.terms]
        here = [one for one, acts in zip(zip(problem.terms, laws, xi, strict=True), acting, strict=True) if acts]
        work, resistances = np.zeros(whole.body.motions), []
        for part, (term, law, of_term) in zip(whole.resistances, here, strict=True):
            growth, weights = _growth(law), part.weights
            mine = of_term[existence.inside(problem, whole.body, term.surface.blocks)]
            if not term.radial:
                work += (weights * mine) @ part.slips[:, 0]
            elif np.isfinite(growth.plus) and growth.plus != 0.0:
                weights = weights * np.maximum(1.0 - mine / growth.plus, 0.0)
            resistances.append(replace(part, weights=weights, growth=growth, peak=growth))
        loads = {**whole.loads, "ξ": system.comm.allreduce(work)}
        if gives_way(system.comm, replace(whole, loads=loads, resistances=tuple(resistances))):
            return True
    return False


def _growth(law: Superpotential) -> Directional:
    """H^∞: the limits of H' on both sides."""
    ends = np.array([-1.0, 1.0]) * DEFAULT.largest_scale
    with np.errstate(over="ignore"):
        here, beyond = (law.convex.right(x) * np.sign(ends) for x in (ends, 2.0 * ends))
    minus, plus = np.where(beyond > here, np.inf, here)
    return Directional(float(minus), float(plus))
