"""A body in space meshed anew by gmsh within its surface: ``python3 -m hvi_fenicsx.mesh.gmsh_worker IN.npz OUT.npz``.

IN holds ``points`` (n, 3), ``triangles`` (t, 3), counterclockwise as seen from outside, ``places`` (k, 3) and the
``sizes`` (k,) of cells wanted near them; OUT will hold ``points`` and ``cells`` (c, 4). It is a process of its own:
gmsh may take any time for a surface that it cannot parametrise, or end with it.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

from ..typing import Array, Integers

_CORNER = math.radians(40.0)
"""By which a surface turns at an edge that is kept."""
_TETRAHEDRON, _TRIANGLE = 4, 2
"""Gmsh's element types."""
_UNIFORM = 1.5
"""Ratio of the sizes below which one is enough."""


def main() -> None:
    """Mesh what the first file describes into the second."""
    import gmsh

    given = np.load(sys.argv[1])
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    _surface(gmsh, given["points"], given["triangles"])
    _wish(gmsh, given["places"], given["sizes"])
    gmsh.model.mesh.generate(3)
    points, cells = _made(gmsh)
    np.savez(sys.argv[2], points=points, cells=cells)


def _surface(gmsh: Any, points: Array, triangles: Integers) -> None:
    """Patches of the surface, parted at its edges, and the volume within."""
    mesh = gmsh.model.mesh
    gmsh.model.addDiscreteEntity(2, 1)
    mesh.addNodes(2, 1, np.arange(1, len(points) + 1), points.ravel())
    mesh.addElementsByType(1, _TRIANGLE, [], (triangles + 1).ravel())
    mesh.classifySurfaces(_CORNER, True, True, math.pi)
    mesh.createGeometry()
    loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
    gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()


def _wish(gmsh: Any, places: Array, sizes: Array) -> None:
    """Ask for cells of these sizes, everywhere that of the nearest place."""
    for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
    if np.ptp(sizes) < (_UNIFORM - 1.0) * np.min(sizes):
        gmsh.option.setNumber("Mesh.MeshSizeMax", float(np.median(sizes)))
        gmsh.option.setNumber("Mesh.MeshSizeMin", float(np.median(sizes)))
        return
    from scipy.spatial import cKDTree

    tree = cKDTree(places)
    gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, size: float(sizes[tree.query((x, y, z))[1]]))


def _made(gmsh: Any) -> tuple[Array, Integers]:
    """Vertices (n, 3) and cells (c, 4) of the volume."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    corners = gmsh.model.mesh.getElementsByType(_TETRAHEDRON)[1].astype(np.int64)
    used, cells = np.unique(corners, return_inverse=True)
    place = np.empty(int(np.max(tags)) + 1, dtype=np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))
    return np.asarray(flat.reshape(-1, 3)[place[used]]), cells.reshape(-1, 4)


if __name__ == "__main__":
    main()
