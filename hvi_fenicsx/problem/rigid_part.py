"""The rigid part of a displacement, which strains nothing.

A body may travel 1e6 times as far as it deforms. The rounding of its stresses then is that of its travel, and its
elastic forces no longer balance each other. Those of the rest do, however far the body is from its place. Of a body
that travels less nothing is taken off, since to take it off rounds too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..typing import Array, Integers
from .problem import Problem
from .thresholds import DEFAULT


@dataclass(frozen=True, kw_only=True)
class BodyMotions:
    """Motions of one body.

    Attributes:
        places: of its values among all local ones, those that this rank owns first, (n,).
        owned: how many these are.
        values: of the motions, (m, n).
    """

    places: Integers
    owned: int
    values: Array


class RigidPart:
    """What motions of bodies make up of some values. Creation is collective.

    Args:
        comm: the ranks.
        bodies: the motions of each body, independent of each other; the same bodies on all ranks.
    """

    def __init__(self, comm: MPI.Comm, bodies: Sequence[BodyMotions]) -> None:
        self._comm = comm
        self._bodies = [_orthonormal(comm, body) for body in bodies]
        self._owned = [_slice(body.places[: body.owned]) for body in bodies]

    def without(self, values: Array, travel: float = DEFAULT.travel) -> Array:
        """Values without the travel of bodies that travel far, (n,); where none does, the same array. Collective.

        Args:
            values: local ones, (n,).
            travel: of a body, relative to its deformation, beyond which it is taken off.
        """
        own = [values[places] for places in self._owned]
        parts = [b.values[:, : b.owned] @ v for b, v in zip(self._bodies, own, strict=True)]
        squares = np.array([v @ v for v in own])
        ends = np.cumsum([len(part) for part in parts])
        *shares, squares = np.split(self._comm.allreduce(np.concatenate([*parts, squares])), ends)
        moved = np.array([share @ share for share in shares])
        if not np.any(moved > 0.5 * travel**2 * (squares - moved)):  # by Pythagoras none is far, rounding included
            return values
        return self._rests(values, shares, travel)

    def _rests(self, values: Array, shares: Sequence[Array], travel: float) -> Array:
        """Values without the travel of bodies that travel far, (n,); shares are the parts of motions. Collective."""
        rests = [values[b.places] - share @ b.values for b, share in zip(self._bodies, shares, strict=True)]
        owned = [rest[: b.owned] for b, rest in zip(self._bodies, rests, strict=True)]
        strained = self._comm.allreduce(np.array([rest @ rest for rest in owned]))
        found = values.copy()
        for body, share, rest, left in zip(self._bodies, shares, rests, strained, strict=True):
            if share @ share > travel**2 * left:
                found[body.places] = rest
        return found


def _slice(places: Integers) -> slice | Integers:
    """Places as a slice where they are consecutive, so that nothing is copied."""
    consecutive = len(places) > 0 and bool(np.all(np.diff(places) == 1))
    return slice(int(places[0]), int(places[-1]) + 1) if consecutive else places


def _orthonormal(comm: MPI.Comm, body: BodyMotions) -> BodyMotions:
    """Motions that span the same and are orthonormal (Euclidean). Collective."""
    own = body.values[:, : body.owned]
    factor = np.linalg.cholesky(comm.allreduce(own @ own.T))
    return replace(body, values=np.asarray(np.linalg.solve(factor, body.values)))


def strained(problem: Problem, u: fem.Function, travel: float = DEFAULT.travel) -> fem.Function:
    """A displacement, of each body that travels far without the rigid motion that is nearest to it. Collective.

    Args:
        problem: the bodies.
        u: nondimensional, ghosts updated.
        travel: of a body, relative to its deformation, beyond which it is far.
    """
    found = fem.Function(problem.space)
    rigid = problem.once("rigid part of displacements", None, lambda: _of_displacements(problem))
    found.x.array[:] = rigid.without(u.x.array, travel)
    return found


def _of_displacements(problem: Problem) -> RigidPart:
    """All rigid motions of all bodies. Collective."""
    points, d = np.asarray(problem.points / problem.scales.length), problem.scales.dimension
    here, every = problem.space.dofmap.index_map.size_local, list[BodyMotions]()
    for body in problem.bodies:
        blocks = np.flatnonzero(problem.bodies.labels == body.index)
        fields = problem.bodies.fields(points[blocks], blocks, body).transpose(1, 0, 2)
        places = (blocks[:, None] * d + np.arange(d)).ravel()
        owned = d * int(np.count_nonzero(blocks < here))
        every.append(BodyMotions(places=places, owned=owned, values=fields.reshape(len(fields), -1)))
    return RigidPart(problem.domain.mesh.comm, every)
