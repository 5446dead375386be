"""Parts that hold two sides which lie on each other, as of two bodies in one mesh or of a slit.

Contact and laws act between the body and a rigid obstacle. On such a part each side would get an obstacle of its own.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..geometry import spot
from ..runtime.mpi import agree
from ..typing import Array
from .contact_surface import Surface
from .thresholds import CompositionThresholds


def refuse(comm: MPI.Comm, surfaces: Iterable[Surface], length: float, thresholds: CompositionThresholds) -> None:
    """Refuse a part with two vertices at one point whose outward normals face each other. Collective.

    Args:
        comm: the ranks.
        surfaces: of the parts with contact or laws.
        length: of the body, m.
        thresholds: what is rounding of a coordinate.

    Raises:
        InputError: on all ranks alike, with the first such point.
    """
    for surface in surfaces:
        gathered = agree(comm, (surface.points, surface.normals))
        points, normals = (np.concatenate(arrays) for arrays in zip(*gathered, strict=True))
        found = _facing(points, normals, thresholds.same * length)
        if found is not None:
            raise InputError(
                f"boundary.{surface.part}: two sides lie on each other at {spot(found[: normals.shape[1]])} and face "
                "each other. Contact and laws of a boundary part act between the body and a rigid obstacle: each side "
                "would be held by an obstacle of its own. Give the part one of the sides only, or name both "
                "in an [interface.NAME]"
            )


def _facing(points: Array, normals: Array, near: float) -> Array | None:
    """The first point (3,) that two vertices with opposite normals share; None: there is none."""
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return None
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    facing = pairs[np.einsum("pi,pi->p", normals[pairs[:, 0]], normals[pairs[:, 1]]) < -0.5]
    return points[np.sort(facing.ravel())[0]] if len(facing) else None
