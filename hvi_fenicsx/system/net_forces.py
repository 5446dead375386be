"""The net forces along the rigid motions of a body, and what they are relative to: for the solvers and the certificate.

A force along a rigid motion does no work in the body: loads, contact and laws balance there by themselves, whatever the
stresses. So it is not judged by these: large loads that balance each other hide no small one that nothing carries.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from ..problem.problem import Problem
from ..problem.references import References
from ..problem.vectors import NodalForces
from ..typing import Array, Entities, Mask
from .free_motions import Motions

NOTHING = 1e-10
"""Part of a rigid motion along a direction, and net force beside the sum of the sizes of all forces, that is none."""
SUMMATION = 1e-14
"""Rounding error of a sum of nodal forces, relative to the sum of their sizes."""


@dataclass(frozen=True)
class Holder:
    """A contact or a law that acts along one direction at some of this rank's vertices, in the components of motions.

    Attributes:
        blocks: the vertices, each once, (m,).
        direction: unit vectors, (m, d).
        force: what it gives along them, (m,).
        least: the least it may give without a change of the displacement, perhaps -inf, (m,).
        most: the most, perhaps inf, (m,).
    """

    blocks: Entities
    direction: Array
    force: Array
    least: Array
    most: Array

    @property
    def forces(self) -> NodalForces:
        """The forces as vectors."""
        return NodalForces(self.blocks, self.direction * self.force[:, None])

    def spare(self, motions: Motions) -> tuple[Array, Array]:
        """By how much its work in motions of a body may fall and rise, (j,) each."""
        along = np.einsum("md,jmd->jm", self.direction, motions.at(self.blocks))
        ends = np.zeros((2, *along.shape))
        for end, limit in zip(ends, (self.least, self.most), strict=True):
            np.multiply(along, limit - self.force, out=end, where=np.abs(along) > NOTHING)
        return -np.sum(np.min(ends, axis=0), axis=1), np.sum(np.max(ends, axis=0), axis=1)


@dataclass(frozen=True, kw_only=True)
class ActingForces:
    """Nodal forces at this rank's vertices, in the components of the motions.

    Attributes:
        left: what is left of all forces that act on the bodies, (vertices, d).
        loads: the loads.
        carried: forces that follow from the displacement.
        holders: contact and laws whose forces do not.
        capable: forces of the laws' own size, along their directions.
    """

    left: Array
    loads: NodalForces
    carried: Sequence[NodalForces]
    holders: Sequence[Holder]
    capable: Sequence[NodalForces]


@dataclass(frozen=True)
class NetForces:
    """Net forces along some motions (j) of one body.

    Attributes:
        left: what nothing carries, nor could carry without a change of the displacement, (j,).
        rounding: the rounding error of it, (j,).
        scale: what it is relative to: the net force of the loads, or what contact and laws carry or could carry, spread
            over a surface as nodal forces are; (j,).
        sizes: the sum of the sizes of all forces, (j,).
    """

    left: Array
    rounding: Array
    scale: Array
    sizes: Array

    @property
    def _acts(self) -> Mask:
        """Along which motions anything acts at all, (j,): a body in neutral balance has none but digits of its mesh."""
        return np.asarray(self.scale > NOTHING * self.sizes)

    @property
    def relative(self) -> tuple[float, float]:
        """The largest relative one, and its rounding, along motions in which anything acts."""
        scale = np.where(self._acts, self.scale, np.inf)
        return float(np.max(self.left / scale, initial=0.0)), float(np.max(self.rounding / scale, initial=0.0))

    @property
    def beyond_rounding(self) -> float:
        """The largest relative one without rounding; infinite where there is nothing that it could be relative to."""
        left = np.maximum(self.left - self.rounding, 0.0) * (self._acts | (self.left > NOTHING * self.sizes))
        found = np.divide(left, self.scale, out=np.where(left > 0, np.inf, 0.0), where=self.scale > 0)
        return float(np.max(found, initial=0.0))


def capable(problem: Problem) -> list[NodalForces]:
    """Forces of the laws' own size along each of their directions."""
    found = []
    for term in problem.terms:
        size = term.weights[:, None] * term.exact.traction_scale
        found += [NodalForces(term.surface.blocks, size * along) for along in np.moveaxis(term.directions, 1, 0)]
    return found


def along(references: References, motions: Motions, acting: ActingForces) -> NetForces:
    """The net forces of one body. Collective.

    Args:
        references: of the problem.
        motions: of the body.
        acting: what acts on all bodies.
    """
    carried = [*acting.carried, *(holder.forces for holder in acting.holders)]
    spare = np.zeros((2, motions.combined.shape[1]))
    for holder in acting.holders:
        spare += holder.spare(motions)
    loads, carry, could = (_works(motions, forces) for forces in ([acting.loads], carried, acting.capable))
    left = motions.works(acting.left)
    sums = np.array([left, loads[0], carry[1], could[1], loads[2] + carry[2], motions.squares, *spare])
    references.problem.domain.mesh.comm.Allreduce(MPI.IN_PLACE, sums)
    left, push, held, able, sizes, squares, fall, rise = sums
    index, lengths = motions.of.body.index, np.sqrt(squares)
    scale = np.max([np.abs(push), held, able], axis=0) * lengths * references.surface[index]
    free = np.maximum(np.abs(left) - np.where(left > 0, fall, rise), 0.0)
    return NetForces(free, SUMMATION * sizes, scale, sizes)


def _works(motions: Motions, forces: Sequence[NodalForces]) -> Array:
    """The work of forces in motions, the sum of its sizes by vertex, and of the products of lengths there, (3, j)."""
    found = np.zeros((3, motions.combined.shape[1]))
    for force in forces:
        fields = motions.at(force.blocks)
        works = np.einsum("md,jmd->jm", force.values, fields)
        lengths = np.linalg.norm(fields, axis=2) @ np.linalg.norm(force.values, axis=1)
        found += [works.sum(axis=1), np.abs(works).sum(axis=1), lengths]
    return found
