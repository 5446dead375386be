"""Rigid motions of bodies: those that supports leave, the net forces along them, and free ones.

A force along a rigid motion does no work in the body: loads, contact and laws balance there by themselves, whatever the
stresses. So it is not judged by these: large loads that balance each other hide no small one that nothing carries.

A free motion nothing holds, and the loads do no work on it: solutions exist, but not one only. Along it the energy is
constant: contact, laws and conditions do not change. Its field is in the null space of every tangent. That null space
is attached to the matrix; preconditioners and direct solvers need a regular matrix, and get it with one unknown pinned
for each motion. Two solutions differ by such motions; the one returned is orthogonal to them in L².
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..problem.references import References
from ..problem.vectors import NodalForces, null_space
from ..rigid import JoinedBodies, Mode, kernel
from ..runtime import forms
from ..runtime.mpi import total
from ..typing import Array, Entities, Mask
from . import existence


@dataclass(frozen=True)
class FreeMotions:
    """The free motions of a system.

    Attributes:
        modes: the motions.
        null_space: their fields in the components of the unknowns, orthonormal (Euclidean).
        pins: local owned dofs, sorted; where they are held (one for each mode, over all ranks), no motion is free.
    """

    modes: tuple[Mode, ...]
    null_space: PETSc.NullSpace
    pins: Entities


def create(vectors: list[PETSc.Vec], modes: Sequence[Mode]) -> FreeMotions:
    """The free motions of a system. Collective.

    Args:
        vectors: the modes' fields in the components of the unknowns; made orthonormal in place.
        modes: the motions.
    """
    spanned = null_space(vectors)
    return FreeMotions(tuple(modes), spanned, _pins(vectors[0].comm.tompi4py(), [v.array_r for v in vectors]))


def fields(problem: Problem, modes: Sequence[Mode]) -> list[fem.Function]:
    """Rigid motions as displacement fields. Collective.

    Args:
        problem: the problem.
        modes: the motions.
    """
    points = problem.points / problem.scales.length
    found = []
    for mode in modes:
        field = fem.Function(problem.space)
        field.x.array[:] = problem.bodies.motion(points, mode).ravel()
        found.append(field)
    return found


def remove_free_motions(problem: Problem, modes: Sequence[Mode], u: fem.Function) -> None:
    """Make a displacement orthogonal, in L², to the free motions. Collective.

    Args:
        problem: the problem.
        modes: the free motions.
        u: the displacement, changed in place.
    """
    free = fields(problem, modes)
    gram = np.array([[_product(a, b) for b in free] for a in free])
    parts = np.linalg.solve(gram, [_product(u, a) for a in free])
    for part, field in zip(parts, free, strict=True):
        u.x.array[:] -= part * field.x.array


def _product(u: fem.Function, v: fem.Function) -> float:
    """∫ u·v dx."""
    return total(u.function_space.mesh.comm, float(fem.assemble_scalar(forms.compiled(ufl.inner(u, v) * ufl.dx))))


def _pins(comm: MPI.Comm, columns: list[Array]) -> Entities:
    """Dofs at which the columns (orthonormal) are far from dependent: always the largest remaining row. Collective."""
    rows = np.array(columns).T.copy()
    pins: list[int] = []
    for _ in columns:
        size = np.linalg.norm(rows, axis=1)
        here = (float(size.max(initial=0.0)), comm.rank)
        there = comm.allreduce(here, op=MPI.MAXLOC)
        row = None
        if there[1] == comm.rank:
            pin = int(size.argmax())
            pins.append(pin)
            row = rows[pin] / size[pin]
        row = comm.bcast(row, root=there[1])
        rows = rows - np.outer(rows @ row, row)
    return np.array(sorted(pins), dtype=np.int32)


@dataclass(frozen=True)
class Motions:
    """Rigid motions of a body that its supports leave, some perhaps twice: those first that contact does not see.

    On interfaces they are relative, as forces there are those of bounds and laws.

    Attributes:
        body: its number.
        fields: the motions at this rank's vertices, Cartesian, zero on other bodies, (j, vertices, d).
    """

    body: int
    fields: Array

    @classmethod
    def of(cls, problem: Problem, body: JoinedBodies, closed: Sequence[tuple[Surface, Mask]] = ()) -> Self:
        """All that supports leave, then those that closed contact does not see. Collective.

        Args:
            problem: the problem.
            body: the body that moves.
            closed: surfaces, and at which of their vertices contact is closed.
        """
        name, origin = f"supported motions of body {body.index}", problem.fixed.tobytes()
        coefficients, fields = problem.once(name, origin, lambda: _supported(problem, body))
        if len(fields) and closed:
            fixed = existence.prescribed(problem, body)
            rows = [existence.normals(problem, body, surface, mask) for surface, mask in closed]
            unseen = kernel(problem.comm, body, [fixed, *rows])
            if unseen.shape[1] < len(fields):
                combined = np.linalg.pinv(coefficients) @ unseen
                fields = np.concatenate([fields, _without_rounding(np.tensordot(combined, fields, (0, 0)))])
        return cls(body.index, fields)

    @cached_property
    def squares(self) -> Array:
        """The square of the length of each on this rank, (j,)."""
        return np.einsum("jvd,jvd->j", self.fields, self.fields)


def _supported(problem: Problem, body: JoinedBodies) -> tuple[Array, Array]:
    """The motions that the supports of a body leave, as coefficients, and at this rank's vertices. Collective."""
    free = kernel(problem.comm, body, [existence.prescribed(problem, body)])
    here = problem.space.dofmap.index_map.size_local
    mine = np.flatnonzero(problem.bodies.labels[:here] == body.index).astype(np.int32)
    fields = np.zeros((free.shape[1], here, problem.dimension))
    fields[:, mine] = np.moveaxis(np.tensordot(problem.motions_at(mine, body), free, (1, 0)), 2, 0)
    return free, _without_rounding(fields)


def _without_rounding(motions: Array) -> Array:
    """Motions without rounding, which is what bodies that move alike have of each other; changed in place."""
    motions[np.abs(motions) <= NOTHING] = 0.0
    return motions


NOTHING = 1e-10
"""Part of a rigid motion along a direction, and net force beside the sum of the sizes of all forces, that is none."""
SUMMATION = 1e-14
"""Rounding error of a sum of nodal forces, relative to the sum of their sizes."""


@dataclass(frozen=True)
class Holder:
    """A contact or a law that acts along one direction at some of this rank's vertices.

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
        along = np.einsum("md,jmd->jm", self.direction, motions.fields[:, self.blocks])
        ends = np.zeros((2, *along.shape))
        for end, limit in zip(ends, (self.least, self.most), strict=True):
            np.multiply(along, limit - self.force, out=end, where=np.abs(along) > NOTHING)
        return -np.sum(np.min(ends, axis=0), axis=1), np.sum(np.max(ends, axis=0), axis=1)


@dataclass(frozen=True, kw_only=True)
class ActingForces:
    """Nodal forces at this rank's vertices, Cartesian.

    Attributes:
        left: what is left of all forces that act on the bodies, (vertices, d).
        loads: the loads.
        carried: forces that follow from the displacement.
        holders: contact and laws whose forces do not.
    """

    left: Array
    loads: NodalForces
    carried: Sequence[NodalForces]
    holders: Sequence[Holder]


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
        return self.scale > NOTHING * self.sizes

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
    """Forces of the laws' own size along each of their directions; linear laws have none.

    Args:
        problem: the problem.
    """
    found = []
    for term in (term for term in problem.terms if not term.exact.is_linear):
        size = term.weights[:, None] * term.exact.traction_scale
        found += [NodalForces(term.surface.blocks, size * along) for along in np.moveaxis(term.directions, 1, 0)]
    return found


def along(references: References, motions: Motions, acting: ActingForces, able: Sequence[NodalForces]) -> NetForces:
    """The net forces of one body. Collective.

    Args:
        references: of the problem.
        motions: of the body.
        acting: what acts on all bodies.
        able: what the laws could give (:func:`capable`).
    """
    carried = [*acting.carried, *(holder.forces for holder in acting.holders)]
    spare = np.zeros((2, len(motions.fields)))
    for holder in acting.holders:
        spare += holder.spare(motions)
    loads, carry, could = (_works(motions, forces) for forces in ([acting.loads], carried, able))
    left = np.tensordot(motions.fields, acting.left)
    sums = np.array([left, loads[0], carry[1], could[1], loads[2] + carry[2], motions.squares, *spare])
    references.problem.comm.Allreduce(MPI.IN_PLACE, sums)
    left, push, held, able, sizes, squares, fall, rise = sums
    scale = np.max([np.abs(push), held, able], axis=0) * np.sqrt(squares) * references.surface[motions.body]
    free = np.maximum(np.abs(left) - np.where(left > 0, fall, rise), 0.0)
    return NetForces(free, SUMMATION * sizes, scale, sizes)


def _works(motions: Motions, forces: Sequence[NodalForces]) -> Array:
    """The work of forces in motions, the sum of its sizes by vertex, and of the products of lengths there, (3, j)."""
    found = np.zeros((3, len(motions.fields)))
    for force in forces:
        fields = motions.fields[:, force.blocks]
        works = np.einsum("md,jmd->jm", force.values, fields)
        lengths = np.linalg.norm(fields, axis=2) @ np.linalg.norm(force.values, axis=1)
        found += [works.sum(axis=1), np.abs(works).sum(axis=1), lengths]
    return found
