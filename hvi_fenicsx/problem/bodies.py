"""The bodies of a mesh: its parts that share no facet with each other, numbered alike on all ranks.

Bodies that meet in interfaces are taken together: what happens to one of them, the others feel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from dolfinx import fem
from mpi4py import MPI

from ..geometry import spot
from ..mesh import hierarchy
from ..mesh.domain import Domain
from ..rigid import JoinedBodies, Mode, RigidBody, rigid_fields
from ..runtime.mpi import agree, refuse
from ..typing import Array, Entities, Integers


@dataclass(frozen=True)
class MeshBodies:
    """The bodies, from left to right (then from bottom to top), lengths in units of L.

    Attributes:
        bodies: what each is, those that meet in interfaces together; the same on all ranks.
        labels: which of these each local vertex (owned and ghost) belongs to, (n,).
        members: which body among those that meet, (n,); 0 of a body that is alone.
    """

    bodies: tuple[JoinedBodies, ...]
    labels: Integers
    members: Integers

    def __iter__(self) -> Iterator[JoinedBodies]:
        return iter(self.bodies)

    def single(self) -> tuple[RigidBody, ...]:
        """All bodies, one by one."""
        return tuple(one for body in self.bodies for one in body.bodies)

    def number_at(self, blocks: npt.NDArray[np.integer]) -> Integers:
        """The numbers of the single bodies of some vertices, (m,).

        Args:
            blocks: local vertices, (m,).
        """
        counts = [len(body.bodies) for body in self.bodies]
        return np.cumsum([0, *counts])[self.labels[blocks]] + self.members[blocks]

    def fields(self, points: Array, blocks: npt.NDArray[np.integer], body: JoinedBodies) -> Array:
        """The basis motions of a body at some of its vertices, (m, motions, d).

        Args:
            points: these vertices in units of L, (m, 3).
            blocks: their local numbers, (m,).
            body: one of these.
        """
        if len(body.bodies) == 1:  # all at once: twice as quick
            return rigid_fields(points, body.bodies[0])
        found = np.zeros((len(points), body.motions, body.dimension))
        for number, one in enumerate(body.bodies):
            here = np.flatnonzero(self.members[blocks] == number)
            found[here[:, None], body.own(number)] = rigid_fields(points[here], one)
        return found

    def motion(self, points: Array, mode: Mode) -> Array:
        """A rigid motion of one body, or of several that meet, the others at rest, (n, d).

        Args:
            points: all local vertices in units of L, (n, 3).
            mode: which body moves, and how.
        """
        every = self.fields(points, np.arange(len(points)), self.bodies[mode.body])
        field = np.einsum("n,mnd->md", mode.coefficients, every)
        return np.where((self.labels == mode.body)[:, None], field, 0.0)


def whole(domain: Domain) -> RigidBody:
    """All that a domain is made of, as one body."""
    return RigidBody(domain.dimension, domain.centre / domain.length, domain.length)


def find(domain: Domain, space: fem.FunctionSpace, points: Array, meetings: Sequence[Entities] = ()) -> MeshBodies:
    """The bodies of a domain. Collective.

    Args:
        domain: what is looked through.
        space: P1 vectors on its mesh.
        points: its local vertices in m, (n, 3).
        meetings: for each interface the local vertices of both sides.

    Raises:
        InputError: on all ranks alike: two bodies meet at a vertex (in 3D perhaps along an edge) only, a hinge.
    """
    one = whole(domain)
    cells, count = hierarchy.labels(domain)
    if count == 1:
        return MeshBodies((JoinedBodies((one,)),), *np.zeros((2, len(points)), np.int64))
    labels = _vertices(domain, space, cells, points)
    lower, upper = _boxes(domain, points[:, : domain.dimension], labels, count)
    centres = (lower + upper) / 2
    order = np.lexsort(np.round(centres / domain.length, 9).T[::-1])
    place = np.argsort(order)
    found = [replace(one, centre=np.pad(centres[i] / domain.length, (0, 3 - domain.dimension))) for i in order]
    names = _names(domain, place[cells], found)
    bodies = [replace(body, name=name) for body, name in zip(found, names, strict=True)]
    return _together(bodies, place[labels], _meeting(domain.mesh.comm, place[labels], meetings))


def _meeting(comm: MPI.Comm, labels: Integers, meetings: Sequence[Entities]) -> list[tuple[int, int]]:
    """The pairs of bodies that meet. Collective."""
    pairs: set[tuple[int, int]] = set()
    for vertices in meetings:
        found = sorted({int(label) for rank in agree(comm, np.unique(labels[vertices])) for label in rank})
        pairs |= {(found[0], other) for other in found[1:]}
    return sorted(pairs)


def _together(bodies: Sequence[RigidBody], labels: Integers, pairs: Sequence[tuple[int, int]]) -> MeshBodies:
    """The bodies with their labels (n,), those of pairs together."""
    group = list(range(len(bodies)))
    for one, other in pairs:
        low, high = sorted((group[one], group[other]))
        group = [low if g == high else g for g in group]
    members: list[list[int]] = [[i for i, g in enumerate(group) if g == first] for first in sorted(set(group))]
    label, member = np.zeros((2, len(bodies)), np.int64)
    found: list[JoinedBodies] = []
    for index, those in enumerate(members):
        label[those], member[those] = index, np.arange(len(those))
        found.append(JoinedBodies(tuple(bodies[i] for i in those), index))
    return MeshBodies(tuple(found), label[labels], member[labels])


def _vertices(domain: Domain, space: fem.FunctionSpace, cells: Integers, points: Array) -> Integers:
    """The body of each local vertex. Collective; refuses a hinge."""
    labels = np.full(len(points), -1, np.int64)
    corners = space.dofmap.list
    labels[corners] = cells[: len(corners), None]
    hinges = corners[labels[corners] != cells[: len(corners), None]]
    apart = np.flatnonzero(labels != hierarchy.of_owners(space.dofmap.index_map, labels))
    said = [
        f"the mesh: at {spot(point[: domain.dimension])} two bodies share a vertex but no facet, and would turn "
        "about it as about a hinge; let them share a facet, or give each its own vertex"
        for point in points[np.concatenate([hinges, apart])[:1]]
    ]
    refuse(domain.mesh.comm, said)
    return labels


def _boxes(domain: Domain, points: Array, labels: Integers, count: int) -> tuple[Array, Array]:
    """Corners of the bodies' bounding boxes, (count, d) each. Collective."""
    lower, upper = np.full((2, count, domain.dimension), [[[np.inf]], [[-np.inf]]])
    np.minimum.at(lower, labels, points)
    np.maximum.at(upper, labels, points)
    comm = domain.mesh.comm
    comm.Allreduce(MPI.IN_PLACE, lower, op=MPI.MIN)
    comm.Allreduce(MPI.IN_PLACE, upper, op=MPI.MAX)
    return lower, upper


def _names(domain: Domain, cells: Integers, bodies: Sequence[RigidBody]) -> list[str]:
    """A body is called by the regions that lie in it alone, else by its number and centre. Collective."""
    regions: dict[int, list[str]] = {}
    for name in sorted(domain.regions):
        inside = np.concatenate(agree(domain.mesh.comm, np.unique(cells[domain.regions[name]])))
        if len(within := np.unique(inside)) == 1:
            regions.setdefault(int(within[0]), []).append(name)
    found = []
    for i, body in enumerate(bodies):
        own = regions.get(i, [])  # without the regions `upper.core` of a body `upper` that is among them
        listed = ", ".join(f'"{name}"' for name in own if name.rpartition(".")[0] not in own)
        at = ", ".join(f"{c:.4g}" for c in body.centre[: body.dimension] * body.length)
        found.append(f"body {listed or f'{i + 1} at ({at})'}")
    return found
