"""The net forces along the rigid motions of a body, and what they are relative to: for the solvers and the certificate.

A force along a rigid motion does no work in the body: loads, contact and laws balance there by themselves, whatever the
stresses. So it is not judged by these: large loads that balance each other hide no small one that nothing carries.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..problem.references import References
from ..rigid import AnyBody, FixedDirections, MotionFields, kernel
from ..typing import Array, Integers, Mask
from . import existence


@dataclass(frozen=True)
class Holder:
    """A contact or a law that acts along one direction at each of this rank's vertices, in the components of motions.

    Attributes:
        direction: unit vectors, zero where nothing acts, (vertices, d).
        force: what it gives along them, (vertices,).
        least: the least it may give without a change of the displacement, perhaps -inf, (vertices,).
        most: the most, perhaps inf, (vertices,).
    """

    direction: Array
    force: Array
    least: Array
    most: Array

    @property
    def forces(self) -> Array:
        """The forces as vectors, (vertices, d)."""
        return self.direction * self.force[:, None]

    def spare(self, fields: Array, tiny: float) -> tuple[Array, Array]:
        """By how much its work in motions (j, vertices, d) may fall and rise, (j,) each.

        Args:
            fields: the motions.
            tiny: the part of a motion along the direction that counts as none.
        """
        at = np.flatnonzero((self.least != self.force) | (self.most != self.force))
        along = np.einsum("vd,jvd->jv", self.direction[at], fields[:, at])
        ends = np.zeros((2, *along.shape))
        for end, limit in zip(ends, (self.least, self.most), strict=True):
            np.multiply(along, (limit - self.force)[at], out=end, where=np.abs(along) > tiny)
        return -np.sum(np.min(ends, axis=0), axis=1), np.sum(np.max(ends, axis=0), axis=1)


@dataclass(frozen=True, kw_only=True)
class ActingForces:
    """Nodal forces at this rank's vertices, each (vertices, d), in the components of the motions.

    Attributes:
        left: what is left of all forces that act on the bodies.
        loads: the loads.
        carried: forces that follow from the displacement.
        holders: contact and laws whose forces do not.
        capable: forces of the laws' own size, along their directions.
        noise: rounding error of a single force, the root of the mean square, by body.
        summation: rounding error of the loads and of what is carried, relative to their size.
        tiny: the part of a motion along a direction that counts as none.
    """

    left: Array
    loads: Array
    carried: Sequence[Array]
    holders: Sequence[Holder]
    capable: Sequence[Array]
    noise: Array
    summation: float
    tiny: float


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

    def acts(self, smallest: float) -> Mask:
        """Along which motions anything acts at all, (j,): a body in neutral balance has none but digits of its mesh.

        Args:
            smallest: of what acts, beside the sum of the sizes of all forces.
        """
        return np.asarray(self.scale > smallest * self.sizes)

    def beyond_rounding(self, smallest: float) -> float:
        """The largest relative one, without rounding; infinite where there is nothing that it could be relative to.

        Args:
            smallest: what acts less than this, beside the sum of the sizes of all forces, does not act.
        """
        left = np.maximum(self.left - self.rounding, 0.0) * (self.acts(smallest) | (self.left > smallest * self.sizes))
        found = np.divide(left, self.scale, out=np.where(left > 0, np.inf, 0.0), where=self.scale > 0)
        return float(np.max(found, initial=0.0))


def motions(problem: Problem, body: AnyBody, closed: Sequence[tuple[Surface, Mask]]) -> Array:
    """Rigid motions that supports leave, then those that closed contact does not see, (j, vertices, d). Collective.

    On interfaces they are relative, as forces there are those of bounds and laws.

    Args:
        problem: the problem.
        body: the body that moves; the fields are zero on the others.
        closed: surfaces, and at which of their vertices contact is closed.
    """
    comm = problem.domain.mesh.comm
    fixed = existence.prescribed_directions(problem, body)
    rows = [_normals(problem, body, surface, mask) for surface, mask in closed]
    free, unseen = kernel(comm, body, [fixed]), kernel(comm, body, [fixed, *rows])
    basis = free if unseen.shape == free.shape else np.hstack([free, unseen])
    here = problem.space.dofmap.index_map.size_local
    mine = problem.bodies.labels[:here] == body.index
    fields = np.einsum("vnd,nj->jvd", problem.motions_at(np.arange(here, dtype=np.int32), body), basis)
    return np.where(mine[:, None], fields, 0.0)


def _normals(problem: Problem, body: AnyBody, surface: Surface, closed: Mask) -> FixedDirections:
    mine = closed & existence.inside(problem, body, surface.blocks)
    return FixedDirections(MotionFields(problem.motions_at(surface.blocks[mine], body)), surface.normals[mine])


def capable(problem: Problem) -> list[Array]:
    """Forces of the laws' own size along each of their directions, (vertices, d) each."""
    found = []
    for term in problem.terms:
        size = term.weights[:, None] * term.exact.traction_scale
        found += [spread(problem, term.surface, size * along) for along in np.moveaxis(term.directions, 1, 0)]
    return found


def spread(problem: Problem, surface: Surface, values: Array) -> Array:
    """Values at a surface's vertices as those at all of this rank's vertices, zero elsewhere, (vertices, d).

    Args:
        problem: the problem.
        surface: its vertices (m).
        values: there, (m, d).
    """
    found = np.zeros((problem.space.dofmap.index_map.size_local, values.shape[1]))
    found[surface.blocks] = values
    return found


def along(references: References, body: AnyBody, fields: Array, acting: ActingForces) -> NetForces:
    """The net forces of one body. Collective.

    Args:
        references: of the problem.
        body: the body.
        fields: its motions, (j, vertices, d).
        acting: what acts on all bodies.
    """
    carried = [*acting.carried, *(holder.forces for holder in acting.holders)]
    spare, none = np.zeros((2, len(fields))), np.zeros(len(fields))
    for holder in acting.holders:
        spare += holder.spare(fields, acting.tiny)
    sums = np.array(
        [
            _work(fields, acting.left),
            _work(fields, acting.loads),
            sum((_works(fields, force) for force in carried), none),
            sum((_works(fields, force) for force in acting.capable), none),
            sum((_sizes(fields, force) for force in (acting.loads, *carried)), none),
            np.einsum("jvd,jvd->j", fields, fields),
            *spare,
        ]
    )
    references.problem.domain.mesh.comm.Allreduce(MPI.IN_PLACE, sums)
    left, push, held, able, sizes, squares, fall, rise = sums
    lengths = np.sqrt(squares)
    scale = np.max([np.abs(push), held, able], axis=0) * lengths * references.surface[body.index]
    rounding = acting.summation * sizes + acting.noise[body.index] * lengths
    return NetForces(np.maximum(np.abs(left) - np.where(left > 0, fall, rise), 0.0), rounding, scale, sizes)


def _work(fields: Array, force: Array) -> Array:
    """The work of a force (vertices, d) in motions (j, vertices, d), (j,)."""
    return np.asarray(fields.reshape(len(fields), force.size) @ force.ravel())


def _works(fields: Array, force: Array) -> Array:
    """The sum of the sizes of the works by vertex, (j,)."""
    at = _acting(force)
    return np.asarray(np.sum(np.abs(np.einsum("vd,jvd->jv", force[at], fields[:, at])), axis=1))


def _sizes(fields: Array, force: Array) -> Array:
    """The sum of the sizes of a force, each times that of the motion there, (j,)."""
    at = _acting(force)
    return np.asarray(np.linalg.norm(fields[:, at], axis=2) @ np.linalg.norm(force[at], axis=1))


def _acting(force: Array) -> Integers:
    """The vertices where a force is not zero: those of a surface, as a rule."""
    return np.flatnonzero(functools.reduce(np.logical_or, (force != 0.0).T))
