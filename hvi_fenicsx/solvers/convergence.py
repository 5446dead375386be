"""When a nonlinear solve has converged: the residual of the inequality, and what rounding leaves of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..system.system import System
from ..typing import Array
from .thresholds import ActiveSetThresholds

Sizes = tuple[float, float]
"""Size of a residual: its norm relative to the load's; its largest nodal traction relative to what is allowed on Γc."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """How one solve ended.

    Attributes:
        converged: by the residual of the inequality.
        newton: Newton steps.
        linear: iterations of linear solvers.
        measure: residual of the inequality, relative.
        reason: PETSc's name of the reason, or ours.
        interrupted: whether it was asked to stop.
        rounding: where the residual no longer falls, the rounding error of it; a residual no larger is converged.
    """

    converged: bool
    newton: int
    linear: int
    measure: float
    reason: str
    interrupted: bool = False
    rounding: float = 0.0


class ConvergenceTest:
    """The convergence test of one system.

    Args:
        system: the assembled problem.
        thresholds: what counts as rounding, and as being on a bound.
    """

    def __init__(self, system: System, thresholds: ActiveSetThresholds) -> None:
        self._system, self._thresholds = system, thresholds
        self._limits = system.residual_limits(1.0)[system.jacobian.rows.dofs]

    def sizes(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> Sizes:
        """Size of the residual of the inequality. Collective.

        Args:
            x: the displacement.
            residual: of the equations at x.
            lower: lower bounds.
            upper: upper bounds.
        """
        at, r = self._system.jacobian.rows.dofs, residual.array_r.copy()
        near = self._thresholds.on_bound
        r[at] = projected(x.array_r[at], r[at], (lower.array_r[at], upper.array_r[at]), near)
        return self.sizes_of(r)

    def sizes_of(self, residual: Array) -> Sizes:
        """Size of a residual that has no reactions of bounds in it, (n,) on this rank. Collective."""
        system = self._system
        nodal = float(np.max(np.abs(residual[system.jacobian.rows.dofs]) / self._limits, initial=0.0))
        norm = float(np.sqrt(system.comm.allreduce(float(residual @ residual)))) / system.scale
        return norm, float(system.comm.allreduce(nodal, op=MPI.MAX))

    def in_contact(self, x: PETSc.Vec) -> int:
        """Vertices on a bound of the problem. Collective."""
        system = self._system
        at = system.jacobian.rows.dofs
        u, lower, upper = x.array_r[at], system.lower.array_r[at], system.upper.array_r[at]
        return int(system.comm.allreduce(int(np.count_nonzero((u <= lower) | (u >= upper)))))

    def accept_rounding(self, found: Outcome, sizes: Sizes, x: PETSc.Vec) -> Outcome:
        """Accept a residual at the rounding floor as converged. Collective.

        The norm and the nodal tractions have a floor each: rounding of the forces inside of the body does not excuse a
        wrong traction on Γc.

        Args:
            found: how the solve ended.
            sizes: of its residual.
            x: the displacement that it ended at.
        """
        thresholds = self._thresholds
        if not np.isfinite(found.measure) or not np.isfinite(x.norm()) or found.measure > thresholds.largest_rounding:
            return found
        sample = self._system.load.duplicate()
        self._system.rounding_sample(x, sample)
        floors = [thresholds.rounding_safety * size for size in self.sizes_of(sample.array_r)]
        sample.destroy()
        if any(size > floor for size, floor in zip(sizes, floors, strict=True)):
            return found
        return replace(found, converged=True, rounding=max(floors), reason="as small as rounding allows")


def projected(x: Array, residual: Array, bounds: tuple[Array, Array], near: float) -> Array:
    """The residual without the reactions that the bounds can bear: zero exactly where the inequality holds, (n,).

    Args:
        x: displacements, (n,).
        residual: of the equations, (n,).
        bounds: lower and upper bounds, (n,) each.
        near: distance that counts as being on a bound.
    """
    at_lower, at_upper = x <= bounds[0] + near, x >= bounds[1] - near
    r = np.where(at_lower, np.minimum(residual, 0.0), residual)
    return np.where(at_upper, np.maximum(r, 0.0), r)
