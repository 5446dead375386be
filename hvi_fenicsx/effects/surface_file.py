"""Surfaces of triangles from STL files, binary or text, and how far points are from them along a direction."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..geometry import ROUNDING
from ..typing import Array

_HEADER = 84
"""Bytes of a binary file before its triangles; the last four are their number."""
_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_NUMBER = r"\s+([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
_CORNERS = 3 * (r"\s+vertex" + 3 * _NUMBER)
_FACET = re.compile(rf"facet\s+normal(?:\s+\S+){{3}}\s+outer\s+loop{_CORNERS}\s+endloop\s+endfacet", re.IGNORECASE)


@lru_cache(maxsize=8)
def triangles(file: Path, changed: int) -> Array:
    """The triangles of an STL file, binary or text, (n, 3, 3), in its unit of length.

    Args:
        file: the file.
        changed: when it was; one that has not changed is read once.

    Raises:
        InputError: it is none, or cut off, or its triangles are no surface.
    """
    corners = _corners(file.read_bytes())
    if corners is None:
        why = "is no STL file, or cut off: neither as a text nor by the number of triangles in it does it end there"
    elif not np.all(np.isfinite(corners)):
        why = "has a corner that is no finite number"
    elif not corners.any() or not _is_surface(corners):
        why = "has no triangles, or several pieces of a surface with free edges"
    else:
        return corners
    raise InputError(f"{file}: {why}; export the surface again")


def _corners(content: bytes) -> Array | None:
    """The triangles of a binary file or of a text; None where it is neither as a whole."""
    count = int.from_bytes(content[_HEADER - 4 : _HEADER], "little")
    if len(content) == _HEADER + _TRIANGLE.itemsize * count:
        return np.frombuffer(content, _TRIANGLE, offset=_HEADER)["corners"].astype(np.float64)
    text = content.decode("latin-1")
    rest = [line.split()[0].lower() for line in _FACET.sub("", text).splitlines() if line.strip()]
    if rest != ["solid", "endsolid"] * (len(rest) // 2):
        return None
    return np.array(_FACET.findall(text), dtype=np.float64).reshape(-1, 3, 3)


def _is_surface(corners: Array) -> bool:
    """Whether triangles are one piece, or have no free edges."""
    import pyvista  # here: most scenes need none

    numbers = np.arange(corners.size // 3).reshape(-1, 3)
    whole = pyvista.PolyData.from_regular_faces(corners.reshape(-1, 3), numbers)  # type: ignore[arg-type]
    surface = whole.clean()
    return surface.n_open_edges == 0 or not np.any(surface.connectivity()["RegionId"])


def distances_along(file: Path, points: Array, direction: Array) -> Array:
    """How far points are from the nearest triangle that faces them, negative behind it; NaN where there is none, (m,).

    All lengths are in the file's unit.

    Args:
        file: STL; the normals of its triangles, by their order of corners, look out of the obstacle.
        points: (m, 3).
        direction: unit vector towards the surface, (3,).

    Raises:
        InputError: the file cannot be read.
    """
    from shapely import STRtree, polygons
    from shapely import points as shapely_points

    corners = triangles(file, file.stat().st_mtime_ns)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing = normals @ direction < -ROUNDING * np.linalg.norm(normals, axis=1)
    corners, normals = corners[facing], normals[facing]
    across = np.linalg.svd(direction[None])[2][1:]
    tree = STRtree(polygons(corners @ across.T))
    at, met = tree.query(shapely_points(points @ across.T), predicate="intersects")
    lengths = np.sum((corners[met, 0] - points[at]) * normals[met], axis=1) / (normals[met] @ direction)
    found = np.full(len(points), np.inf)
    order = np.argsort(-np.abs(lengths), kind="stable")
    found[at[order]] = lengths[order]
    return np.where(np.isinf(found), np.nan, found)
