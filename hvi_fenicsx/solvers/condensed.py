"""The paper's own procedure (Ovcharova and Gwinner, section 5.2), with which the other methods are compared.

The stiffness is condensed to the contact displacements, a dense Schur complement. The variational inequality there is
written as a mixed complementarity problem, that as a system of equations by the Fischer-Burmeister function
f(a, b) = √(a² + b²) - (a + b), and ½‖Φ‖² is minimised by a trust-region method from zero in at most 100 iterations:
``lsqnonlin`` in the paper, here ``scipy.optimize.least_squares`` of the same family. One process only.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from petsc4py import PETSc
from scipy.linalg import block_diag
from scipy.optimize import least_squares

from ..errors import InputError
from ..system.equations import VertexModel
from ..system.factorisation import form_of
from ..system.interior import PREFIX, Interior
from ..system.system import System
from ..typing import Array
from .convergence import Counts
from .method import Method, SolveContext, SolveResult

_STATUS = {
    0: "the evaluations are used up",
    2: "the merit function falls no more",
    3: "the steps vanish",
    4: "the merit function falls no more and the steps vanish",
}
"""Texts for scipy's status."""


def onto_bounds(system: System, x: PETSc.Vec, residual: PETSc.Vec) -> PETSc.Vec:
    """An admissible copy of x, with those dofs on their bound whose force there is larger than their distance from it.

    Fischer-Burmeister iterates come near their bounds without ever being on them. Nondimensional nodal stiffnesses are
    about 1, so distances compare with forces, as in the primal-dual active set method.

    Args:
        system: the assembled problem.
        x: the displacement.
        residual: of the equations at x.
    """
    found = x.copy()
    value, force = x.array_r, residual.array_r
    lower, upper = system.lower.array_r, system.upper.array_r
    found.array[:] = np.where(value - lower <= force, lower, np.where(upper - value <= -force, upper, value))
    found.array[:] = np.clip(found.array_r, lower, upper)
    return found


class Condensation(Method):
    """The procedure on one system; call :meth:`solve` once.

    Raises:
        InputError: there are several processes.
    """

    name = "condensed"
    description = "the paper's procedure: condensation and least squares"
    takes_pieces = False

    def __init__(self, context: SolveContext) -> None:
        super().__init__(context)
        if self.system.comm.size > 1:
            raise InputError(
                f'solver.method = "{self.name}" is dense and runs in one process, not in {self.system.comm.size}: '
                'leave out --np (mpirun), or use method = "auto"'
            )
        self.models = [VertexModel(t.law) for t in self.system.terms]
        self.stopped = False

    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point of the smoothed energy, or what was found instead.

        Args:
            start: not used; the paper begins at zero.

        Raises:
            SolverError: the stiffness without its contact displacements is singular.
        """
        with self.context.timer("setup"):
            mixed = _Complementarity(self.system, self.models)
        with self.context.timer("solve"):
            values, reason, counts = self._minimise(mixed)
            found, measure = self._judge(mixed.expand(values))
        converged = measure <= self.options.tolerance
        failure = f"least squares stopped: {reason}, residual {measure:.1e}"
        return SolveResult(
            u=self.system.displacement(found),
            method=self.name,
            converged=converged,
            reason="stationary" if converged else failure,
            counts=counts,
            energies=(self.system.equations.energy(found, self.models),),
            interrupted=self.stopped and not converged,
        )

    def _minimise(self, mixed: _Complementarity) -> tuple[Array, str, Counts]:
        """Contact displacements, why it ended there, and evaluations; not by the gradient, small wherever Φ is."""
        counts, start = Counts(), np.zeros(len(mixed.kept))
        if not start.size:
            return start, "there is nothing to minimise over", counts
        points: list[Array] = []

        def function(x: Array) -> Array:
            counts.newton += 1
            return mixed.function(x)

        def jacobian(x: Array) -> Array:
            self._record(mixed, x, points)
            return mixed.jacobian(x)

        most, least = self.options.max_iterations, self.system.thresholds.energy_rounding
        try:
            found = least_squares(function, start, jacobian, max_nfev=most, ftol=least, xtol=least, gtol=None)
        except _Stop:
            return points[-1], "interrupted", counts
        return found.x, f"{_STATUS.get(found.status, found.message)}, merit {found.cost:.1e}", counts

    def _record(self, mixed: _Complementarity, x: Array, points: list[Array]) -> None:
        """Keep and report an accepted point."""
        points.append(x.copy())
        size = float(np.linalg.norm(mixed.function(x))) / (self.system.load.norm() or 1.0)
        self.context.tell(self.name, self.context.epsilon, len(points) - 1, size, mixed.in_contact(x))
        self.stopped = self.solver.interrupted()
        if self.stopped:
            raise _Stop

    def _judge(self, x: PETSc.Vec) -> tuple[PETSc.Vec, float]:
        """The candidate for a solution at x, and its residual of the inequality in the full space."""
        residual = x.duplicate()
        self.system.equations.residual(x, residual, self.models)
        found = onto_bounds(self.system, x, residual)
        self.system.equations.residual(found, residual, self.models)
        return found, self.solver.convergence.sizes(found, residual, self.system.lower, self.system.upper).worst


class _Stop(Exception):
    """The user wants it to end."""


class _Complementarity:
    """lower ≤ x ≤ upper ⟂ F(x) = S x - f + law, as Φ(x) = 0, over the displacements x of Γc that are not prescribed.

    Attributes:
        kept: their dofs, ascending, (n,).
    """

    def __init__(self, system: System, models: Sequence[VertexModel]) -> None:
        self._system, self._models, self._residual = system, models, system.load.duplicate()
        self._last: tuple[Array, PETSc.Vec] | None = None
        system.jacobian.set_rates([np.zeros_like(k) for k in system.jacobian.rates])
        rows = system.jacobian.rows
        self.kept = np.setdiff1d(rows.dofs, system.problem.fixed)
        self._here = np.searchsorted(rows.dofs, self.kept)
        self._interior = Interior(form_of(system, PREFIX), self.kept)
        self._stiffness = self._interior.stiffness()
        self._bounds = system.lower.array_r[self.kept], system.upper.array_r[self.kept]

    def expand(self, x: Array) -> PETSc.Vec:
        """The displacement of the whole body in equilibrium with these contact displacements; the last one is kept."""
        if self._last is None or not np.array_equal(self._last[0], x):
            found = self._system.load.duplicate()
            found.array[:] = self._interior.expand(x, self._system.load.array_r)
            self._last = x.copy(), found
        return self._last[1]

    def force(self, x: Array) -> Array:
        """F, (n,): the residual on Γc of a body that is in equilibrium inside."""
        self._system.equations.residual(self.expand(x), self._residual, self._models)
        return self._residual.array_r[self.kept]

    def tangent(self, x: Array) -> Array:
        """F', (n, n)."""
        jacobian = self._system.jacobian
        jacobian.set_rates(self._system.equations.tangents(self.expand(x), self._models))
        return self._stiffness + block_diag(*jacobian.rows.tangent)[np.ix_(self._here, self._here)]

    def function(self, x: Array) -> Array:
        """Φ, (n,)."""
        return _mixed(x, self.force(x), *self._bounds)[0]

    def jacobian(self, x: Array) -> Array:
        """An element of Φ's B-subdifferential, (n, n)."""
        _, by_x, by_force = _mixed(x, self.force(x), *self._bounds)
        return np.diag(by_x) + by_force[:, None] * self.tangent(x)

    def in_contact(self, x: Array) -> int:
        """The number of dofs whose distance from a bound is smaller than their force."""
        force, (low, high) = self.force(x), self._bounds
        return int(np.count_nonzero((x - low <= force) | (high - x <= -force)))


def fischer_burmeister(a: Array, b: Array) -> tuple[Array, Array, Array]:
    """f(a, b) = √(a² + b²) - (a + b) and its derivatives; at the origin, where f has none, those along a = b > 0.

    Args:
        a: (n,).
        b: (n,).

    Returns:
        f and its derivatives by a and by b, (n,) each.
    """
    root = np.hypot(a, b)
    cos, sin = (np.divide(v, root, out=np.full_like(root, np.sqrt(0.5)), where=root > 0) for v in (a, b))
    return root - (a + b), cos - 1.0, sin - 1.0


def _mixed(x: Array, force: Array, lower: Array, upper: Array) -> tuple[Array, Array, Array]:
    """Φ and its derivatives by x and F: Billups' f(x - l, f(u - x, -F)); for an infinite bound its f is left out."""
    capped, bounded = np.isfinite(upper), np.isfinite(lower)
    value, by_distance, by_force = fischer_burmeister(np.where(capped, upper - x, 0.0), -force)
    inner = np.where(capped, value, force)
    inner_x, inner_f = np.where(capped, -by_distance, 0.0), np.where(capped, -by_force, 1.0)
    value, by_distance, by_inner = fischer_burmeister(np.where(bounded, x - lower, 0.0), inner)
    outer = np.where(bounded, by_inner, 1.0)
    return (
        np.where(bounded, value, inner),
        np.where(bounded, by_distance, 0.0) + outer * inner_x,
        outer * inner_f,
    )
