"""What rounding makes of a condensed stiffness along rigid motions: no force, as exact arithmetic has it.

S = A_kk - A_ki A_ii⁻¹ A_ik is a difference of large numbers where a body is slender or nearly incompressible. So its
forces along a rigid motion are not quite zero. Contact and laws would carry them, and the certificate excuses no net
force. With Q an orthonormal basis of the motions, (1 - QQᵀ) S (1 - QQᵀ) has none, and Qᵀf is what the loads do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from ..typing import Array, Integers
from .interior import Interior
from .supported_body import SupportedBody
from .system import System

_UNSEEN = 1e-10
"""A motion that moves no condensed unknown, relative to the one that moves them most."""


@dataclass(frozen=True, kw_only=True)
class RigidMotions:
    """Rigid motions that the supports of bodies leave, at condensed unknowns.

    Attributes:
        basis: Q, orthonormal, (n, j).
        fields: the same motions at this rank's unknowns, (local unknowns, j).
    """

    basis: Array
    fields: Array

    @classmethod
    def of(cls, system: System, interior: Interior, stay: Integers) -> Self:
        """Those of a system; none where something resists them, or the unknowns do not see each. Collective.

        Args:
            system: the system.
            interior: its unknowns of Γc.
            stay: those of them that the condensed problem has.
        """
        fields = _fields(system)
        basis, triangle = np.linalg.qr(interior.gathered(fields)[stay])
        lengths = np.abs(np.diagonal(triangle))
        if len(lengths) < fields.shape[1] or np.any(lengths <= _UNSEEN * np.max(lengths, initial=0.0)):
            return cls(basis=basis[:, :0], fields=fields[:, :0])
        return cls(basis=basis, fields=np.linalg.solve(triangle.T, fields.T).T)

    def without_forces(self, stiffness: Array) -> Array:
        """A stiffness whose forces along the motions are zero, (n, n).

        Args:
            stiffness: symmetric, (n, n).
        """
        q = self.basis
        defect = stiffness @ q
        found = stiffness - defect @ q.T - q @ (defect.T - (q.T @ defect) @ q.T)
        return np.asarray(0.5 * (found + found.T))

    def with_work(self, force: Array, work: Array) -> Array:
        """Condensed loads whose work in the motions is that of the loads on the bodies, (n, k).

        Args:
            force: condensed, (n, k).
            work: of the loads on the bodies, (j, k).
        """
        return np.asarray(force + self.basis @ (work - self.basis.T @ force))


def _fields(system: System) -> Array:
    """The motions at this rank's unknowns, (local unknowns, j)."""
    problem, frames = system.problem, system.frames
    if problem.bulk.foundation is not None or system.comm.allreduce(len(system.pins)):
        return np.zeros((system.load.local_size, 0))
    bodies = (SupportedBody.of(problem, body) for body in problem.bodies)
    local = (lambda v: v) if frames is None else frames.local_components
    fields = [body.in_components(local).fields for body in bodies]
    every = np.concatenate([f.reshape(len(f), system.load.local_size) for f in fields])
    return np.asarray(every.T)
