"""The net forces that a residual leaves along the rigid motions of the bodies, as the certificate judges them."""

from __future__ import annotations

import numpy as np
from petsc4py import PETSc

from ..problem.contact_surface import Surface
from ..problem.nodal_forces import NodalForces
from ..system import net_forces
from ..system.net_forces import ActingForces, Holder, NetForces
from ..system.supported_body import Motions, SupportedBody
from ..system.system import System
from ..typing import Array, Mask
from .thresholds import ActiveSetThresholds


class NetForceTest:
    """The net forces of one system. Creation is collective.

    Args:
        system: the assembled problem.
        thresholds: what counts as being on a bound.
    """

    def __init__(self, system: System, thresholds: ActiveSetThresholds) -> None:
        self._system, self._thresholds = system, thresholds
        self._d = system.problem.scales.dimension
        self._contact = (system.jacobian.rows.dofs[:: self._d] // self._d).astype(np.int32)
        self._loads = NodalForces.of(self._local(system.pushing))
        self._capable = [self._local_part(force) for force in net_forces.capable(system.problem)]
        bodies = (SupportedBody.of(system.problem, body) for body in system.problem.bodies)
        self._bodies = [body.in_components(self._local) for body in bodies]
        self._masks: list[Mask] | None = None
        self._motions: list[Motions] = []

    def sizes(self, x: PETSc.Vec, residual: Array, projected: Array, on: tuple[Mask, Mask]) -> tuple[Array, Array]:
        """The largest net force of each body, relative, and what it grows by with a unit of noise. Collective.

        Args:
            x: the displacement.
            residual: of the equations at x, (n,) on this rank.
            projected: the residual without the reactions of bounds, (n,).
            on: which unknowns of Γc are on their lower and on their upper bound, (k,) each.
        """
        system = self._system
        self._find_motions(x)
        at = system.jacobian.rows.dofs
        laws = residual[at] - system.jacobian.elastic_at_contact(x) + system.load.array_r[at]
        acting = ActingForces(
            left=-self._blocks(projected),
            loads=self._loads,
            carried=[NodalForces(self._contact, -self._blocks(laws))],
            holders=self._holders(residual[at] - projected[at], *on),
            capable=self._capable,
            noise=np.ones(system.references.count),
            summation=0.0,
            tiny=self._thresholds.along,
        )
        found = [self._relative(net_forces.along(system.references, y, acting)) for y in self._motions]
        return np.array([left for left, _ in found]), np.array([noise for _, noise in found])

    def _holders(self, reactions: Array, on_lower: Mask, on_upper: Mask) -> list[Holder]:
        """The bounds that are reached: each pushes along the axis of its unknown."""
        least, most = np.where(on_upper, -np.inf, 0.0), np.where(on_lower, np.inf, 0.0)
        columns = [self._blocks(values) for values in (reactions, least, most)]
        axes = (np.broadcast_to(axis, columns[0].shape) for axis in np.eye(self._d))
        return [Holder(self._contact, axis, *(c[:, k] for c in columns)) for k, axis in enumerate(axes)]

    def _relative(self, net: NetForces) -> tuple[float, float]:
        """The largest net force and its rounding, along motions in which anything acts at all."""
        acts = net.acts(self._thresholds.nothing_acts)
        scale = np.where(acts, net.scale, np.inf)
        return float(np.max(net.left / scale, initial=0.0)), float(np.max(net.rounding / scale, initial=0.0))

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
        normal, near = sign * x.array_r[dofs], self._thresholds.on_bound * system.references.at(bounds.surface.blocks)
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
