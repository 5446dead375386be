"""Which ranks have which parts of several bodies: parts that meet are on one rank, where reflections bring that about.

Smoothers of multigrid on a rank see nothing of the others' new values. Where the two sides of an interface are on
different ranks, all that couples the bodies is between ranks, and more iterations are needed.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from mpi4py import MPI

from ..typing import Array
from .joined import PlacedBody

_NEAR = 1e-6
"""Parts this near meet, relative to the size of the larger one."""


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
    best = ways[int(np.argmax(met >= (1.0 - _NEAR) * np.max(met)))]
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
    near = _NEAR * max(float(np.max(np.ptp(box, axis=0))) for box in (one, other))
    extents = np.sort(np.minimum(one[1], other[1]) - np.maximum(one[0], other[0]))
    return float(np.prod(extents[1:])) if extents[0] > -near and extents[1] > near else 0.0
