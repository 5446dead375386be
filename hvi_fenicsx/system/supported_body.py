"""The rigid motions of a body that its supports leave, and those of them that closed contact does not see."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from ..problem.contact_surface import Surface
from ..problem.problem import Problem
from ..rigid import AnyBody, FixedDirections, MotionFields, kernel
from ..typing import Array, Entities, Mask
from . import existence


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
