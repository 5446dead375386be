"""Boundary edges in the plane chained to lines: the body's outline, and the stretch of it that a contact part is."""

from __future__ import annotations

import numpy as np
from matplotlib.path import Path as DrawnPath

from ...typing import Array, Integers


def chains(edges: Integers) -> list[Integers]:
    """Oriented edges (k, 2) as chains of vertices; a closed one ends where it starts."""
    after: dict[int, list[int]] = {}
    for a, b in zip(map(int, edges[:, 0]), map(int, edges[:, 1]), strict=True):
        after.setdefault(a, []).append(b)
    inner = set(map(int, edges[:, 1]))
    starts = [a for a in after if a not in inner]
    found = []
    while after:
        vertex = starts.pop() if starts else next(iter(after))
        chain = [vertex]
        while vertex in after:
            following = after[vertex]
            vertex = following.pop()
            if not following:
                del after[chain[-1]]
            chain.append(vertex)
        found.append(np.array(chain))
    return found


def closed_path(points: Array, loops: list[Integers]) -> DrawnPath:
    """The outline as one path, holes included, fit for clipping."""
    paths = [DrawnPath(points[loop, :2], closed=True) for loop in loops]
    return DrawnPath.make_compound_path(*paths)


def normals(points: Array, chain: Integers) -> Array:
    """Outward unit normals (m, 2) at a chain's vertices: the body is on the left of its edges."""
    along = np.diff(points[chain, :2], axis=0)
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    closed = chain[0] == chain[-1]
    first, last = (outward[-1:], outward[:1]) if closed else (outward[:1], outward[-1:])
    summed = np.concatenate([first, outward]) + np.concatenate([outward, last])
    return np.asarray(summed / np.linalg.norm(summed, axis=1)[:, None])
