"""Free motions: rigid motions that nothing holds and on which the loads do no work. Solutions exist, but not one only.

Along such a motion the energy is constant: contact, laws and conditions do not change. Its field is in the null space
of every tangent. That null space is attached to the matrix; preconditioners and direct solvers need a regular matrix,
and get it with one unknown pinned for each motion. Two solutions differ by such motions; the one returned is orthogonal
to them in L².
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..problem.vectors import null_space
from ..rigid import AnyBody, FixedDirections, Mode, MotionFields, kernel
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
    points = np.asarray(problem.points / problem.scales.length)
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
class SupportedBody:
    """A body, and the rigid motions of it that its supports leave.

    On interfaces they are relative, as forces there are those of bounds and laws.

    Attributes:
        problem: the problem.
        body: the body that moves.
        coefficients: of the motions, (basis motions, n).
        fields: the motions at this rank's vertices, zero on other bodies, (n, vertices, d).
    """

    problem: Problem
    body: AnyBody
    coefficients: Array
    fields: Array

    @classmethod
    def of(cls, problem: Problem, body: AnyBody) -> Self:
        """A body of a problem. Collective.

        Args:
            problem: the problem.
            body: the body that moves.
        """
        name, origin = f"supported motions of body {body.index}", problem.fixed.tobytes()
        return cls(problem, body, *problem.once(name, origin, lambda: _supported(problem, body)))

    def in_components(self, components: Callable[[Array], Array]) -> Self:
        """The same, its fields in other components; ``components`` makes them of vectors (vertices, d)."""
        fields = np.array([components(field) for field in self.fields]).reshape(self.fields.shape)
        return replace(self, fields=fields)

    @cached_property
    def products(self) -> Array:
        """The products of each two motions, on this rank, (n, n)."""
        return np.asarray(np.tensordot(self.fields, self.fields, ((1, 2), (1, 2))))

    def motions(self, closed: Sequence[tuple[Surface, Mask]]) -> Motions:
        """All of these, then those that closed contact does not see. Collective.

        Args:
            closed: surfaces, and at which of their vertices contact is closed.
        """
        count, comm = len(self.fields), self.problem.domain.mesh.comm
        fixed = existence.prescribed_directions(self.problem, self.body)
        rows = [_normals(self.problem, self.body, surface, mask) for surface, mask in closed]
        unseen = kernel(comm, self.body, [fixed, *rows]) if count else np.empty((len(self.coefficients), 0))
        if unseen.shape[1] == count:
            return Motions(self, np.eye(count))
        return Motions(self, np.hstack([np.eye(count), np.linalg.pinv(self.coefficients) @ unseen]))


@dataclass(frozen=True)
class Motions:
    """Some rigid motions (j) of a body.

    Attributes:
        of: the body.
        combined: how they are made of the motions that its supports leave, (n, j).
    """

    of: SupportedBody
    combined: Array

    def at(self, blocks: Entities) -> Array:
        """The motions at some vertices (m,), (j, m, d)."""
        return np.asarray(np.einsum("nmd,nj->jmd", self.of.fields[:, blocks], self.combined))

    def works(self, forces: Array) -> Array:
        """The work of forces at all of this rank's vertices, (vertices, d), in each, (j,)."""
        fields = self.of.fields
        return np.asarray(self.combined.T @ (fields.reshape(len(fields), forces.size) @ forces.ravel()))

    @property
    def squares(self) -> Array:
        """The square of the length of each on this rank, (j,)."""
        return np.asarray(np.einsum("nj,nk,kj->j", self.combined, self.of.products, self.combined))


def _supported(problem: Problem, body: AnyBody) -> tuple[Array, Array]:
    """The motions that the supports of a body leave, as coefficients, and at this rank's vertices. Collective."""
    free = kernel(problem.domain.mesh.comm, body, [existence.prescribed_directions(problem, body)])
    here = problem.space.dofmap.index_map.size_local
    mine = np.flatnonzero(problem.bodies.labels[:here] == body.index).astype(np.int32)
    fields = np.zeros((free.shape[1], here, problem.scales.dimension))
    fields[:, mine] = np.moveaxis(np.tensordot(problem.motions_at(mine, body), free, (1, 0)), 2, 0)
    return free, fields


def _normals(problem: Problem, body: AnyBody, surface: Surface, closed: Mask) -> FixedDirections:
    mine = closed & existence.inside(problem, body, surface.blocks)
    return FixedDirections(MotionFields(problem.motions_at(surface.blocks[mine], body)), surface.normals[mine])
