"""Chains of boundary edges in the plane, drawn: the body's outline, and the normals along a part of it."""

from __future__ import annotations

import numpy as np
from matplotlib.path import Path as DrawnPath

from ...typing import Array, Integers


def closed_path(points: Array, loops: list[Integers]) -> DrawnPath:
    """The outline as one path, holes included, fit for clipping.

    Args:
        points: the vertices, (n, 2) or (n, 3).
        loops: the closed chains of the outline.
    """
    paths = [DrawnPath(points[loop, :2], closed=True) for loop in loops]
    return DrawnPath.make_compound_path(*paths)


def normals(points: Array, chain: Integers) -> Array:
    """Outward unit normals (m, 2) at a chain's vertices: the body is on the left of its edges.

    Args:
        points: the vertices, (n, 2) or (n, 3).
        chain: of m vertices, closed where it ends with the vertex that it begins with.
    """
    along = np.diff(points[chain, :2], axis=0)
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    closed = chain[0] == chain[-1]
    first, last = (outward[-1:], outward[:1]) if closed else (outward[:1], outward[-1:])
    summed = np.concatenate([first, outward]) + np.concatenate([outward, last])
    return np.asarray(summed / np.linalg.norm(summed, axis=1)[:, None])
