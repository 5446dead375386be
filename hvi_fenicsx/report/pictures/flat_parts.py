"""Contact parts in space laid flat: along two of the coordinate axes, or unrolled where a part goes round an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...typing import Array, Integers, Mask
from ..body_mesh import BodyMesh
from ..units import Unit, unit_for
from .shape import PartGeometry

CLOSED = 0.5
"""A part whose normals add up to less than this share of its area goes round the axis that they are most across."""


@dataclass(frozen=True, kw_only=True)
class FlatPart:
    """A part laid flat.

    Attributes:
        points: its vertices, m, (m, 2).
        facets: its facets by its vertices, (k, 3); none across the cut of one that was unrolled.
        ways: the unit vectors along which the two coordinates grow at each vertex, (m, 2, 3).
        names: of the coordinates.
        how: it was laid flat, in words; empty of a plane part along coordinate axes.
    """

    points: Array
    facets: Integers
    ways: Array
    names: tuple[str, str]
    how: str

    @property
    def unit(self) -> Unit:
        """The unit of the coordinates."""
        return unit_for(float(np.abs(self.points).max()), "m")

    def along(self, vectors: Array) -> Array:
        """The components of vectors (m, 3) along the coordinates, (m, 2)."""
        return np.asarray(np.einsum("md,mwd->mw", vectors, self.ways))


def laid_flat(geometry: PartGeometry, body: BodyMesh) -> FlatPart:
    """Lay a part flat: along the two coordinate axes that are most along it, or unrolled.

    Args:
        geometry: where the part lies on the body.
        body: the body.
    """
    points, triangles = geometry.part.points, geometry.row[geometry.facets]
    mean = body.mean_normal(geometry.facets)
    if float(np.linalg.norm(mean)) < CLOSED:
        return _unrolled(points, triangles, geometry.part.normal, ~geometry.part.idle)
    seen = int(np.argmax(np.abs(mean)))
    kept = [i for i in range(3) if i != seen]
    return FlatPart(
        points=points[:, kept],
        facets=triangles,
        ways=np.broadcast_to(np.eye(3)[kept], (len(points), 2, 3)),
        names=("xyz"[kept[0]], "xyz"[kept[1]]),
        how="" if abs(mean[seen]) > 1.0 - 1e-6 else f"seen along {'xyz'[seen]}",
    )


def _unrolled(points: Array, triangles: Integers, normals: Array, touches: Mask) -> FlatPart:
    """Angle times mean radius, and the way along the axis that the normals are most across; cut opposite to contact."""
    axis = np.linalg.eigh(normals.T @ normals)[1][:, 0]
    largest = int(np.argmax(np.abs(axis)))
    straight = abs(axis[largest]) > np.cos(np.radians(2))
    axis = np.eye(3)[largest] if straight else axis * np.sign(axis[largest])
    towards = 0 if abs(axis[0]) < np.sqrt(0.5) else 1
    first = np.eye(3)[towards] - axis[towards] * axis
    first /= np.linalg.norm(first)
    plane = np.stack([first, np.cross(axis, first)])
    arms = points @ plane.T
    arms = arms - np.linalg.lstsq(np.column_stack([2.0 * arms, np.ones(len(arms))]), np.sum(arms**2, axis=1))[0][:2]
    angles, radius = np.arctan2(arms[:, 1], arms[:, 0]), float(np.linalg.norm(arms, axis=1).mean())
    start = float(np.angle(np.sum(np.exp(1j * angles[touches])))) - np.pi
    angles = start + np.mod(angles - start, 2.0 * np.pi)
    onward = np.column_stack([-np.sin(angles), np.cos(angles)]) @ plane
    name = "xyz"[largest] if straight else ""
    return FlatPart(
        points=np.column_stack([radius * angles, points @ axis]),
        facets=triangles[np.ptp(angles[triangles], axis=1) < np.pi],
        ways=np.stack([onward, np.broadcast_to(axis, onward.shape)], axis=1),
        names=(f"way round, 0 towards +{'xyz'[towards]},", name or "way along,"),
        how=f"unrolled about {name or 'its axis'}",
    )
