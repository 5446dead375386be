"""Bodies in their places: those that overlap are refused."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from mpi4py import MPI
from scipy.spatial import cKDTree

from .. import compat
from ..errors import InputError
from ..geometry import ROUNDING, spot
from ..runtime.mpi import agree
from ..typing import Array
from .joined import PlacedBody
from .transfer import barycentric_weights

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
