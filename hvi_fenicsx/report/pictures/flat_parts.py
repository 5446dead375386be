"""Contact parts in space laid flat: along two of the coordinate axes, or unrolled where a part goes round an axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...typing import Array, Integers, Mask
from ..body_mesh import BodyMesh
from .deformed import PartGeometry
from .vtk_view import area_vectors

CLOSED = 0.5
"""A part whose normals add up to less than this share of its area may go round an axis."""
ALONG = 0.05
"""So small a share of its area looks along that axis, and at least twice as much along any direction across."""
STRAIGHT = np.cos(np.radians(2.0))
"""An axis is along a coordinate axis from this cosine on."""


@dataclass(frozen=True, kw_only=True)
class FlatPart:
    """A part laid flat.

    Attributes:
        points: its vertices, m, (m, 2); those of facets across a cut occur on both sides of it.
        rows: of each of them its row in the part's table, (m,).
        triangles: its facets by its vertices, (k, 3).
        ways: the unit vectors along which the two coordinates grow at each vertex, (m, 2, 3).
        names: of the coordinates.
        ends: the lower left and the upper right corner of the map, m, (2, 2); facets across a cut reach beyond.
        how: it was laid flat, in words; empty of a plane part along coordinate axes.
    """

    points: Array
    rows: Integers
    triangles: Integers
    ways: Array
    names: tuple[str, str]
    ends: Array
    how: str

    def along(self, vectors: Array) -> Array:
        """The components of vectors along the coordinates, (m, 2).

        Args:
            vectors: by row of the part's table, (rows, 3).
        """
        return np.asarray(np.einsum("md,mwd->mw", vectors[self.rows], self.ways))


def laid_flat(geometry: PartGeometry, body: BodyMesh) -> FlatPart:
    """Lay a part flat: along the two coordinate axes that are most along it, or unrolled; a whole ball about z.

    Args:
        geometry: where the part lies on the body.
        body: the body.
    """
    areas = area_vectors(body.points, geometry.facets)
    total, size = areas.sum(axis=0), float(np.linalg.norm(areas, axis=1).sum())
    points, triangles = geometry.part.points, geometry.row[geometry.facets]
    closed = float(np.linalg.norm(total)) < 1e-6 * size
    axis = _axis(areas) if float(np.linalg.norm(total)) < CLOSED * size else None
    if axis is None and not closed:
        plane = float(np.abs(total).max()) > (1.0 - 1e-6) * size
        return _projected(points, triangles, total, "" if plane else "seen along {}")
    return _unrolled(points, triangles, np.array([0.0, 0.0, 1.0]) if axis is None else axis, ~geometry.part.idle)


def _axis(areas: Array) -> Array | None:
    """The axis that a part goes round, its largest component positive; None where it goes round none.

    Facets are not quite along the axis of a round bore: one that is nearly along a coordinate axis is along it.
    """
    sizes = np.maximum(np.linalg.norm(areas, axis=1), 1e-300)
    shares, directions = np.linalg.eigh(areas.T @ (areas / sizes[:, None]) / float(sizes.sum()))
    if shares[0] > ALONG or shares[1] < 2.0 * ALONG:
        return None
    found = directions[:, 0]
    largest = int(np.argmax(np.abs(found)))
    return np.eye(3)[largest] if abs(found[largest]) > STRAIGHT else np.asarray(found * np.sign(found[largest]))


def _projected(points: Array, triangles: Integers, total: Array, how: str) -> FlatPart:
    seen = int(np.argmax(np.abs(total)))
    kept = [i for i in range(3) if i != seen]
    axes = np.eye(3)[kept]
    flat = points @ axes.T
    return FlatPart(
        points=flat,
        rows=np.arange(len(points)),
        triangles=triangles,
        ways=np.broadcast_to(axes, (len(points), 2, 3)),
        names=("xyz"[kept[0]], "xyz"[kept[1]]),
        ends=np.stack([flat.min(axis=0), flat.max(axis=0)]),
        how=how.format("xyz"[seen]),
    )


def _unrolled(points: Array, triangles: Integers, axis: Array, touches: Mask) -> FlatPart:
    """Angle times mean radius, and the way along the axis."""
    towards = 0 if abs(axis[0]) < np.sqrt(0.5) else 1
    plane = _across(axis, towards)
    arms = points @ plane.T
    arms = arms - _centre(arms)
    angles, (start, end) = _from_cut(np.arctan2(arms[:, 1], arms[:, 0]), triangles, touches)
    rows, triangles, turns = _cut(angles, triangles)
    angles, radius = angles[rows], float(np.linalg.norm(arms, axis=1).mean())
    height = points @ axis
    onward = np.column_stack([-np.sin(angles), np.cos(angles)]) @ plane
    named = "xyz"[int(np.argmax(axis))] if np.max(axis) == 1.0 else ""
    return FlatPart(
        points=np.column_stack([radius * (angles + 2.0 * np.pi * turns), height[rows]]),
        rows=rows,
        triangles=triangles,
        ways=np.stack([onward, np.broadcast_to(axis, onward.shape)], axis=1),
        names=(f"way round, 0 towards +{'xyz'[towards]},", named or "way along,"),
        ends=np.array([[radius * start, height.min()], [radius * end, height.max()]]),
        how=f"unrolled about {named or 'its axis'}",
    )


def _across(axis: Array, towards: int) -> Array:
    """Two unit vectors across an axis, the first as near as possible to one of the coordinate axes, (2, 3)."""
    first = np.eye(3)[towards] - axis[towards] * axis
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def _centre(points: Array) -> Array:
    """The centre of the circle nearest to points in a plane, (2,)."""
    matrix = np.column_stack([2.0 * points, np.ones(len(points))])
    return np.asarray(np.linalg.lstsq(matrix, np.sum(points**2, axis=1))[0][:2])


def _from_cut(angles: Array, triangles: Integers, touches: Mask) -> tuple[Array, tuple[float, float]]:
    """Angles over one turn from a cut, and where the part begins and ends.

    The cut is in the middle of what no facet covers, else opposite to where the part touches.
    """
    ordered = np.sort(angles)
    gaps = np.diff(np.append(ordered, ordered[0] + 2.0 * np.pi))
    widest = int(np.argmax(gaps))
    found = _turned(angles, ordered[widest] + 0.5 * gaps[widest] - 2.0 * np.pi)
    if not np.any(_across_cut(found[triangles])):
        return found, (float(found.min()), float(found.max()))
    start = float(np.angle(np.sum(np.exp(1j * angles[touches])))) - np.pi
    return _turned(angles, start), (start, start + 2.0 * np.pi)


def _turned(angles: Array, start: float) -> Array:
    """Angles within one turn from a start."""
    return np.asarray(start + np.mod(angles - start, 2.0 * np.pi))


def _across_cut(corners: Array) -> Mask:
    """Whether facets lie across the cut, from the angles of their corners, (k,)."""
    return np.asarray(np.ptp(corners, axis=1) > np.pi)


def _cut(angles: Array, triangles: Integers) -> tuple[Integers, Integers, Array]:
    """Facets across the cut are there twice, beyond its end and before its start, each time with vertices of its own.

    Args:
        angles: of the vertices, within one turn, (m,).
        triangles: the facets by their vertices, (k, 3).

    Returns:
        The rows of all vertices, the facets, and the whole turns that are added to the angles of the vertices.
    """
    corners = angles[triangles]
    across = _across_cut(corners)
    early = corners < corners.max(axis=1, keepdims=True) - np.pi
    rows, turns, facets = [np.arange(len(angles))], [np.zeros(len(angles))], [triangles[~across]]
    for turn, moved in ((1.0, early[across]), (-1.0, ~early[across])):
        own = triangles[across]
        copied, number = np.unique(own[moved], return_inverse=True)
        own[moved] = sum(map(len, rows)) + number
        rows.append(copied)
        turns.append(np.full(len(copied), turn))
        facets.append(own)
    return np.concatenate(rows), np.concatenate(facets), np.concatenate(turns)
