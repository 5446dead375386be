"""Surfaces of triangles from STL files, and how far points are from them along a direction."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np

from ..errors import InputError
from ..geometry import ROUNDING
from ..typing import Array


def triangles(file: Path) -> Array:
    """The triangles of a file, (n, 3, 3), in the file's unit of length; one that has not changed is read once.

    Args:
        file: STL, binary or text.

    Raises:
        InputError: there is none, or VTK, which reads it, is missing.
    """
    state = file.stat() if file.exists() else None
    return _read(file, state and (state.st_mtime_ns, state.st_size))


@lru_cache(maxsize=8)
def _read(file: Path, state: tuple[int, int] | None) -> Array:
    """The triangles of a file in a state."""
    try:
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkCommonCore import vtkObject
        from vtkmodules.vtkIOGeometry import vtkSTLReader
    except ImportError:
        raise InputError(f"{file}: VTK reads STL files; install python3-vtk9 (Debian) or vtk (pip, conda)") from None
    reader = vtkSTLReader()
    reader.SetFileName(str(file))
    shown = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    reader.Update()
    vtkObject.SetGlobalWarningDisplay(shown)
    surface = reader.GetOutput()
    if surface.GetNumberOfCells() == 0:
        raise InputError(f"{file}: is no STL file with triangles")
    points = vtk_to_numpy(surface.GetPoints().GetData()).astype(np.float64)
    corners = vtk_to_numpy(surface.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    return np.asarray(points[corners])


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

    corners = triangles(file)
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
