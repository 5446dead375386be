"""Bodies in their places: those that overlap are refused."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from mpi4py import MPI
from scipy.spatial import cKDTree

from ..errors import InputError
from ..geometry import ROUNDING, spot
from ..runtime.mpi import agree
from ..typing import Array
from .joined import PlacedBody, _placed
from .transfer import barycentric_weights

_NEAREST = 4
"""Cells that are looked at for each point, by their middles."""


def check_places(comm: MPI.Comm, bodies: Sequence[PlacedBody]) -> None:
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
            near = (np.all((own[k].max(axis=1) > low) & (own[k].min(axis=1) < high), axis=1) for k in (i, j))
            first, second = (np.concatenate(agree(comm, own[k][here])) for k, here in zip((i, j), near, strict=True))
            at = _inside(first.mean(axis=1), second)
            if len(at):
                raise InputError(
                    f'domain.{bodies[i].name}: at {spot(at[0])} it overlaps the body "{bodies[j].name}"; '
                    "move one of them by its origin, or make them one body"
                )


def _corners(body: PlacedBody) -> Array:
    """The corners of the cells that this rank owns, in their place, (c, d+1, d)."""
    placed = _placed(body)
    return placed.points[placed.cells]


def _box(comm: MPI.Comm, corners: Array) -> tuple[Array, Array]:
    """The box of a body. Collective."""
    flat = corners.reshape(-1, corners.shape[2])
    every = agree(comm, (flat.min(axis=0, initial=np.inf), flat.max(axis=0, initial=-np.inf)))
    return np.min([low for low, _ in every], axis=0), np.max([high for _, high in every], axis=0)


def _inside(points: Array, cells: Array) -> Array:
    """The points well within a cell: each weight is two fifths of those of its middle; (k, d).

    The facets of curved sides that touch overlap by less.
    """
    if not len(points) or not len(cells):
        return points[:0]
    _, near = cKDTree(cells.mean(axis=1)).query(points, k=list(range(1, min(_NEAREST, len(cells)) + 1)))
    least = barycentric_weights(cells[near], points[:, None]).min(axis=2)
    return np.asarray(points[np.any(5 * cells.shape[1] * least > 2, axis=1)])
