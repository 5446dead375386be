"""Bodies in their places: those that overlap are refused, and the parts of those that meet are on one rank.

Smoothers of multigrid on a rank see nothing of the others' new values. Where the two sides of an interface are on
different ranks, all that couples the bodies is between ranks, and more iterations are needed. So the parts of blocks
are reflected where more of them then meet.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from mpi4py import MPI
from scipy.spatial import cKDTree

from .. import compat
from ..errors import InputError
from ..geometry import spot
from ..runtime.mpi import agree
from ..typing import Array
from .joined import PlacedBody
from .thresholds import ROUNDING
from .transfer import barycentric_weights


def near_parts(comm: MPI.Comm, bodies: Sequence[PlacedBody]) -> list[PlacedBody]:
    """The bodies, the parts of blocks reflected where more of them then meet parts of other bodies. Collective.

    Args:
        comm: the ranks that share each of the meshes.
        bodies: in their places.
    """
    found: list[PlacedBody] = []
    for body in bodies:
        found.append(_reflected(comm, body, found) if comm.size > 1 else body)
    return found


def _reflected(comm: MPI.Comm, body: PlacedBody, others: Sequence[PlacedBody]) -> PlacedBody:
    """The body, its parts reflected such that those of each rank meet the most. Collective."""
    domain = body.domain
    if domain.reflected is None or not others:
        return body
    d = domain.dimension
    ways = [axes for count in range(d + 1) for axes in itertools.combinations(range(d), count)]
    boxes = [_part_box(other) for other in others]
    met = comm.allreduce(np.array([sum(_met(_part_box(body, axes), box) for box in boxes) for axes in ways]))
    best = ways[int(np.argmax(met >= (1.0 - ROUNDING) * np.max(met)))]
    return replace(body, domain=domain.reflected(best)) if best else body


def _part_box(body: PlacedBody, reflected: Sequence[int] = ()) -> Array:
    """The box around this rank's part in its place, (2, d), along the axes of the coordinates; (0, d): no part."""
    domain = body.domain
    points = domain.mesh.geometry.x[:, : domain.dimension]
    if not len(points):
        return np.empty((0, domain.dimension))
    ends = np.array([np.min(points, axis=0), np.max(points, axis=0)])
    for axis in reflected:
        ends[:, axis] = domain.lower[axis] + domain.upper[axis] - ends[::-1, axis]
    corners = body.at(np.array(list(itertools.product(*ends.T))))
    return np.array([np.min(corners, axis=0), np.max(corners, axis=0)])


def _met(one: Array, other: Array) -> float:
    """The area, in the plane the length, on which two boxes meet."""
    if not len(one) or not len(other):
        return 0.0
    near = ROUNDING * max(float(np.max(np.ptp(box, axis=0))) for box in (one, other))
    extents = np.sort(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]))
    return float(np.prod(extents[1:])) if extents[0] > -near and extents[1] > near else 0.0


_WITHIN = 0.15
"""The least barycentric weight of a point well within a cell: the facets of curved sides that touch overlap by less."""
_NEAREST = 4
"""Cells that are looked at for each point, by their middles."""


@dataclass(frozen=True)
class _Cells:
    """The cells of a body on all ranks that lie in some box: corners (c, d+1, d)."""

    corners: Array

    @property
    def middles(self) -> Array:
        return np.asarray(self.corners.mean(axis=1))


def check(comm: MPI.Comm, bodies: Sequence[PlacedBody]) -> None:
    """Refuse bodies that overlap. Collective.

    Args:
        comm: the ranks.
        bodies: meshed and in their places.

    Raises:
        InputError: on all ranks alike, with a place.
    """
    own = [_corners(body) for body in bodies]
    boxes = [_box(comm, corners) for corners in own]
    for i, j in permutations(range(len(bodies)), 2):
        low, high = np.maximum(boxes[i][0], boxes[j][0]), np.minimum(boxes[i][1], boxes[j][1])
        if np.all(high - low > ROUNDING * np.max(boxes[i][1] - boxes[i][0])):
            first, second = (_near(comm, own[k], low, high) for k in (i, j))
            at = _inside(first.middles, second)
            if len(at):
                raise InputError(
                    f'domain.{bodies[i].name}: at {spot(at[0])} it overlaps the body "{bodies[j].name}"; '
                    "move one of them by its origin, or make them one body"
                )


def _corners(body: PlacedBody) -> Array:
    """The corners of the cells that this rank owns, in their place, (c, d+1, d)."""
    mesh, d = body.domain.mesh, body.domain.dimension
    cells = compat.geometry_dofmap(mesh)[: mesh.topology.index_map(d).size_local]
    return body.at(mesh.geometry.x[:, :d])[cells]


def _box(comm: MPI.Comm, corners: Array) -> tuple[Array, Array]:
    """The box of a body. Collective."""
    d = corners.shape[2]
    flat = corners.reshape(-1, d)
    every = agree(comm, (flat.min(axis=0, initial=np.inf), flat.max(axis=0, initial=-np.inf)))
    return np.min([low for low, _ in every], axis=0), np.max([high for _, high in every], axis=0)


def _near(comm: MPI.Comm, corners: Array, low: Array, high: Array) -> _Cells:
    """The cells of all ranks that reach into a box. Collective."""
    here = np.all((corners.max(axis=1) > low) & (corners.min(axis=1) < high), axis=1)
    return _Cells(np.concatenate(agree(comm, corners[here])))


def _inside(points: Array, cells: _Cells) -> Array:
    """The points that lie well within a cell, (k, d)."""
    if not len(points) or not len(cells.corners):
        return points[:0]
    count = min(_NEAREST, len(cells.corners))
    _, near = cKDTree(cells.middles).query(points, k=list(range(1, count + 1)))
    least = barycentric_weights(cells.corners[near], points[:, None]).min(axis=2)
    return np.asarray(points[np.any(least > _WITHIN, axis=1)])
