"""Laws at vertices whose displacement is prescribed: the support carries them beside the body's own forces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..laws import Superpotential
from ..problem.problem import Problem
from ..runtime.mpi import agree
from ..typing import Array, Integers


@dataclass(frozen=True, kw_only=True)
class HeldLaw:
    """One law at m such vertices, of all ranks.

    Attributes:
        law: j.
        parts: number of the part whose support holds the vertex, (m,).
        forces: on the support for a unit traction, (m, d).
        constants: what the law acts on, at the factor 0, (m,).
        rates: how that grows with the factor, (m,).
    """

    law: Superpotential
    parts: Integers
    forces: Array
    constants: Array
    rates: Array

    def on_supports(self, factor: float, largest: tuple[float, float] | None, count: int) -> Array:
        """The forces on the supports of all parts, (count, d).

        Args:
            factor: λ.
            largest: the least and the greatest factor so far, for bonds that remember; None for those that do not.
            count: of parts.
        """
        x = self.constants + factor * self.rates
        traction = 0.5 * (self.law.left(x) + self.law.right(x))
        if largest is not None:
            traction = self._remembered(x, traction, largest)
        found = np.zeros((count, self.forces.shape[1]))
        np.add.at(found, self.parts, self.forces * traction[:, None])
        return found

    def _remembered(self, x: Array, traction: Array, largest: tuple[float, float]) -> Array:
        """Below the greatest displacement so far: along the secant."""
        ends = np.array([self.constants + factor * self.rates for factor in largest])
        if self.law.even:
            far = np.abs(ends).max(axis=0) * np.sign(x)
        else:
            far = np.where(x > 0.0, np.maximum(ends.max(axis=0), 0.0), np.minimum(ends.min(axis=0), 0.0))
        secant = np.divide(
            0.5 * (self.law.left(far) + self.law.right(far)), far, out=np.zeros_like(far), where=far != 0
        )
        return np.where(np.abs(x) < np.abs(far), secant * x, traction)


def find(problem: Problem, parts: Mapping[int, int], prescribed: Array) -> tuple[HeldLaw, ...]:
    """The laws of a problem whose argument is prescribed. Collective.

    Args:
        problem: the problem; laws on |u_t| in space are left out.
        parts: the number of the part whose support counts, by scalar unknown of this rank.
        prescribed: displacements, constant and scaled, zero where nothing is prescribed, (local unknowns, 2).
    """
    found = []
    for term in problem.terms:
        if term.radial:
            continue
        direction, dofs = term.directions[:, 0], term.surface.dofs
        along = direction != 0.0
        held = np.isin(dofs, problem.fixed_here)
        here = np.flatnonzero(np.all(held | ~along, axis=1))
        main = dofs[here, np.argmax(np.abs(direction[here]), axis=1)]
        entries = (
            np.array([parts.get(int(dof), -1) for dof in main], dtype=np.int64),
            direction[here] * term.weights[here, None],
            np.einsum("md,mdc->mc", direction[here], prescribed[dofs[here]]) / term.stretch[here, None],
        )
        numbers, forces, arguments = (np.concatenate(agree(problem.domain.mesh.comm, e)) for e in entries)
        known = numbers >= 0
        if np.any(known):
            found.append(
                HeldLaw(
                    law=term.law,
                    parts=numbers[known],
                    forces=forces[known],
                    constants=arguments[known, 0],
                    rates=arguments[known, 1],
                )
            )
    return tuple(found)
