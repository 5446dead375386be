"""When a nonlinear solve has converged: the residual of the inequality, and what rounding leaves of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from ..problem.problem import Bounds
from ..problem.vectors import NodalForces
from ..system import rigid_motions
from ..system.rigid_motions import ActingForces, Holder, Motions
from ..system.system import System
from ..typing import Array, Mask


@dataclass(frozen=True, slots=True)
class Sizes:
    """Size of a residual of the inequality, relative, by body.

    Attributes:
        norm: its Euclidean norm, over the forces there (:class:`.References`).
        traction: the largest nodal traction on Γc, over what is allowed there.
        net: the largest net force along a rigid motion (:mod:`..system.rigid_motions`).
        net_rounding: of that.
    """

    norm: Array
    traction: Array
    net: Array
    net_rounding: Array

    @property
    def worst(self) -> float:
        """The largest one."""
        return float(np.max([self.norm, self.traction, self.net]))


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
    """

    def __init__(self, system: System) -> None:
        self._system, self._thresholds = system, system.thresholds
        rows = system.jacobian.rows.dofs
        self._limits = traction_limits(system)[rows]
        self._blocks = rows // system.problem.dimension
        self._near = self._thresholds.near * system.references.at(self._blocks)
        self._loads = NodalForces.of(system.pushing)
        self._able = rigid_motions.capable(system.problem)
        self._masks: list[Mask] | None = None
        self._motions: list[Motions] = []

    def sizes(self, x: PETSc.Vec, residual: PETSc.Vec, lower: PETSc.Vec, upper: PETSc.Vec) -> Sizes:
        """Size of the residual of the inequality. Collective.

        Args:
            x: the displacement.
            residual: of the equations at x.
            lower: lower bounds.
            upper: upper bounds.
        """
        at, r = self._system.jacobian.rows.dofs, residual.array_r.copy()
        on_lower = x.array_r[at] <= lower.array_r[at] + self._near
        on_upper = x.array_r[at] >= upper.array_r[at] - self._near
        r[at] = projected(r[at], on_lower, on_upper)
        return Sizes(*self._forces(r, x), *self._net_forces(x, residual.array_r, r, on_lower, on_upper))

    def _forces(self, residual: Array, x: PETSc.Vec) -> tuple[Array, Array]:
        """Norm and largest traction on Γc of a residual (n,) at x, relative, by body. Collective."""
        references = self._system.references
        forces = references.forces(x.array_r, self._system.holding_forces(x))
        nodal = np.abs(residual[self._system.jacobian.rows.dofs]) / self._limits
        return references.norms(residual) / forces, references.largest(self._blocks, nodal)

    def _net_forces(self, x: PETSc.Vec, residual: Array, left: Array, on_lower: Mask, on_upper: Mask) -> Array:
        """The largest net force along a rigid motion of each body, relative, and its rounding, (2, bodies). Collective.

        The residual is that of the equations, (n,); left is what of it bounds do not bear, (n,); k unknowns of Γc are
        on their bounds.
        """
        system, axes = self._system, self._system.contact_axes
        rows, d = system.jacobian.rows, axes.shape[1]
        at, contact = rows.dofs, rows.vertices.astype(np.int32)
        self._find_motions(x)
        laws, acting = system.equations.at_contact(x) - residual[at], -left.reshape(-1, d)
        laws, acting[contact] = (np.einsum("mij,mi->mj", axes, v.reshape(-1, d)) for v in (laws, acting[contact]))
        least, most = np.where(on_upper, -np.inf, 0.0), np.where(on_lower, np.inf, 0.0)
        columns = [values.reshape(-1, d) for values in (residual[at] - left[at], least, most)]
        holders = [Holder(contact, axes[:, k], *(c[:, k] for c in columns)) for k in range(d)]
        forces = ActingForces(left=acting, loads=self._loads, carried=[NodalForces(contact, laws)], holders=holders)
        nets = [rigid_motions.along(system.references, y, forces, self._able) for y in self._motions]
        return np.array([net.relative for net in nets]).T

    def _find_motions(self, x: PETSc.Vec) -> None:
        """The motions that supports leave, and those that closed contact does not see, where that has changed."""
        problem, masks = self._system.problem, [self._closed(x, bounds) for bounds in self._system.bounds]
        known = self._masks is not None and all(map(np.array_equal, masks, self._masks))
        if self._system.comm.allreduce(not known):
            closed = [(bounds.surface, mask) for bounds, mask in zip(problem.bounds, masks, strict=True)]
            self._motions = [Motions.of(problem, body, closed) for body in problem.bodies]
        self._masks = masks

    def _closed(self, x: PETSc.Vec, bounds: Bounds) -> Mask:
        """Where some bounds are reached."""
        dofs, sign = bounds.component()
        near = self._thresholds.near * self._system.references.at(bounds.surface.blocks)
        return bounds.beyond(sign * x.array_r[dofs]) >= -near

    def rounding(self, x: PETSc.Vec) -> Array:
        """What rounding makes of norm and largest traction of the residual at x, (2, bodies). Collective.

        Args:
            x: the displacement.
        """
        sample = self._system.load.duplicate()
        self._system.equations.rounding_sample(x, sample)
        return self._thresholds.rounding_safety * np.array(self._forces(sample.array_r, x))

    def in_contact(self, x: PETSc.Vec) -> int:
        """Vertices on a bound of the problem. Collective."""
        system = self._system
        at = system.jacobian.rows.dofs
        u, lower, upper = x.array_r[at], system.lower.array_r[at], system.upper.array_r[at]
        return int(system.comm.allreduce(int(np.count_nonzero((u <= lower) | (u >= upper)))))

    def accept_rounding(self, found: Outcome, sizes: Sizes, x: PETSc.Vec, tolerance: float) -> Outcome:
        """Accept a residual at the rounding floor as converged. Collective.

        The norm and the nodal tractions of each body have a floor each: rounding of the forces inside of a body does
        not excuse a wrong traction on Γc, nor another body. Of a net force only rounding of its sum is excused.

        Args:
            found: how the solve ended.
            sizes: of its residual.
            x: the displacement that it ended at.
            tolerance: of the net forces.
        """
        if found.converged or not (np.isfinite(x.norm()) and sizes.worst <= self._thresholds.coarse_tolerance):
            return found
        norm, traction = self.rounding(x)
        if (
            np.any(sizes.norm > norm)
            or np.any(sizes.traction > traction)
            or np.any(sizes.net > np.maximum(sizes.net_rounding, tolerance))
        ):
            return found
        floor = float(np.max([norm, traction]))
        return replace(found, converged=True, rounding=floor, reason="as small as rounding allows")


def projected(residual: Array, on_lower: Mask, on_upper: Mask) -> Array:
    """The residual without the reactions that the bounds can bear: zero exactly where the inequality holds, (k,).

    Args:
        residual: of the equations, at unknowns that may have bounds, (k,).
        on_lower: which of these are on their lower bound, (k,).
        on_upper: which are on their upper bound, (k,).
    """
    r = np.where(on_lower, np.minimum(residual, 0.0), residual)
    return np.where(on_upper, np.maximum(r, 0.0), r)


def traction_limits(system: System) -> Array:
    """The residual that is a traction on Γc of the size that tractions are relative to, by unknown; else infinite."""
    references, limits = system.references, np.full(system.load.local_size, np.inf)
    for bounds in system.bounds:
        dofs, _ = bounds.component()
        limits[dofs] = np.minimum(limits[dofs], references.at(bounds.surface.blocks) * bounds.surface.weights)
    for term in system.terms:
        dofs = term.surface.dofs
        touched = np.any(term.directions != 0, axis=1)
        limit = references.traction_scale(term) * term.weights
        limits[dofs[touched]] = np.minimum(limits[dofs], limit[:, None])[touched]
    return limits


@dataclass
class Counts:
    """Iterations spent.

    Attributes:
        newton: Newton steps.
        linear: iterations of linear solvers.
        branch: convex steps.
    """

    newton: int = 0
    linear: int = 0
    branch: int = 0

    def add_outcome(self, step: Outcome) -> None:
        """Add the iterations of one solve of the active set solver."""
        self.newton += step.newton
        self.linear += step.linear

    def add(self, other: Counts) -> None:
        """Add the iterations of another method."""
        self.newton += other.newton
        self.linear += other.linear
        self.branch += other.branch
