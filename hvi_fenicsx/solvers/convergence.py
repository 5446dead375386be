"""When a nonlinear solve has converged: the residual of the inequality, and what rounding leaves of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from petsc4py import PETSc

from ..problem.contact_surface import Surface
from ..problem.vectors import NodalForces
from ..system import rigid_motions
from ..system.rigid_motions import ActingForces, Holder, Motions, SupportedBody
from ..system.system import System
from ..typing import Array, Mask


@dataclass(frozen=True, slots=True)
class Sizes:
    """Size of a residual of the inequality, relative, by body.

    Attributes:
        norm: its Euclidean norm, over the forces there (:class:`.References`).
        traction: the largest nodal traction on Γc, over what is allowed there.
        net: the largest net force along a rigid motion (:mod:`.net_forces`).
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

    def followed_by(self, other: Outcome) -> Outcome:
        """The outcome of another solve from there, with the iterations of both."""
        return replace(other, newton=self.newton + other.newton, linear=self.linear + other.linear)


class ConvergenceTest:
    """The convergence test of one system.

    Args:
        system: the assembled problem.
    """

    def __init__(self, system: System) -> None:
        self._system, self._thresholds = system, system.thresholds
        rows = system.jacobian.rows.dofs
        self._limits = traction_limits(system)[rows]
        self._blocks = rows // system.problem.scales.dimension
        self._near = self._thresholds.near * system.references.at(self._blocks)
        self._net = NetForceTest(system)

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
        net = self._net.sizes(x, residual.array_r, r, (on_lower, on_upper))
        return Sizes(*self._forces(r, x), *net)

    def _forces(self, residual: Array, x: PETSc.Vec) -> tuple[Array, Array]:
        """Norm and largest traction of a residual (n,) at x, relative, by body. Collective."""
        references = self._system.references
        forces = references.forces(x.array_r, self._system.holding_forces(x))
        return references.norms(residual) / forces, self._traction(residual)

    def _traction(self, residual: Array) -> Array:
        """The largest traction of a residual (n,) on Γc, relative, by body. Collective."""
        nodal = np.abs(residual[self._system.jacobian.rows.dofs]) / self._limits
        return self._system.references.largest(self._blocks, nodal)

    def rounding(self, x: PETSc.Vec) -> tuple[Array, Array]:
        """What rounding makes of the norm and the largest traction of the residual at x, by body. Collective.

        Args:
            x: the displacement.
        """
        sample = self._system.load.duplicate()
        self._system.equations.rounding_sample(x, sample)
        norm, traction = self._forces(sample.array_r, x)
        sample.destroy()
        return self._thresholds.rounding_safety * norm, self._thresholds.rounding_safety * traction

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


class NetForceTest:
    """The net forces of one system. Creation is collective.

    Args:
        system: the assembled problem.
    """

    def __init__(self, system: System) -> None:
        self._system, self._thresholds = system, system.thresholds
        self._d = system.problem.scales.dimension
        self._contact = (system.jacobian.rows.dofs[:: self._d] // self._d).astype(np.int32)
        self._loads = NodalForces.of(self._local(system.pushing))
        self._capable = [self._local_part(force) for force in rigid_motions.capable(system.problem)]
        bodies = (SupportedBody.of(system.problem, body) for body in system.problem.bodies)
        self._bodies = [body.in_components(self._local) for body in bodies]
        self._masks: list[Mask] | None = None
        self._motions: list[Motions] = []

    def sizes(self, x: PETSc.Vec, residual: Array, projected: Array, on: tuple[Mask, Mask]) -> Array:
        """The largest net force of each body, relative, and its rounding, (2, bodies). Collective.

        Args:
            x: the displacement.
            residual: of the equations at x, (n,) on this rank.
            projected: the residual without the reactions of bounds, (n,).
            on: which unknowns of Γc are on their lower and on their upper bound, (k,) each.
        """
        system = self._system
        self._find_motions(x)
        at = system.jacobian.rows.dofs
        laws = residual[at] - system.equations.at_contact(x)
        acting = ActingForces(
            left=-self._blocks(projected),
            loads=self._loads,
            carried=[NodalForces(self._contact, -self._blocks(laws))],
            holders=self._holders(residual[at] - projected[at], *on),
            capable=self._capable,
        )
        nets = [rigid_motions.along(system.references, y, acting) for y in self._motions]
        return np.array([net.relative for net in nets]).T

    def _holders(self, reactions: Array, on_lower: Mask, on_upper: Mask) -> list[Holder]:
        """The bounds that are reached: each pushes along the axis of its unknown."""
        least, most = np.where(on_upper, -np.inf, 0.0), np.where(on_lower, np.inf, 0.0)
        columns = [self._blocks(values) for values in (reactions, least, most)]
        axes = (np.broadcast_to(axis, columns[0].shape) for axis in np.eye(self._d))
        return [Holder(self._contact, axis, *(c[:, k] for c in columns)) for k, axis in enumerate(axes)]

    def _find_motions(self, x: PETSc.Vec) -> None:
        """The motions that supports leave, and those that closed contact does not see, where that has changed."""
        system = self._system
        closed = [self._closed(x, k) for k in range(len(system.bounds))]
        masks = [mask for _, mask in closed]
        known = self._masks is not None and all(map(np.array_equal, masks, self._masks))
        if system.comm.allreduce(not known):
            self._motions = [body.motions(closed) for body in self._bodies]
        self._masks = masks

    def _closed(self, x: PETSc.Vec, k: int) -> tuple[Surface, Mask]:
        """The surface of some bounds, and where they are reached."""
        system = self._system
        bounds = system.bounds[k]
        dofs, sign = bounds.component()
        normal, near = sign * x.array_r[dofs], self._thresholds.near * system.references.at(bounds.surface.blocks)
        return system.problem.bounds[k].surface, bounds.beyond(normal) >= -near

    def _local(self, vectors: Array) -> Array:
        """Vectors (vertices, d) in the components of the unknowns."""
        frames = self._system.frames
        return vectors if frames is None else frames.local_components(vectors)

    def _local_part(self, forces: NodalForces) -> NodalForces:
        """Forces in the components of the unknowns."""
        every = np.zeros((len(self._system.pushing), self._d))
        every[forces.blocks] = forces.values
        return NodalForces(forces.blocks, self._local(every)[forces.blocks])

    def _blocks(self, values: Array) -> Array:
        return values.reshape(-1, self._d)


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
