"""A body in space meshed anew by gmsh within its surface: ``python3 -m hvi_fenicsx.mesh.gmsh_worker IN.npz OUT.npz``.

IN holds ``points`` (n, 3), ``triangles`` (t, 3), counterclockwise as seen from outside, ``places`` (k, 3) and the
``sizes`` (k,) of cells wanted near them; OUT will hold ``points`` and ``cells`` (c, 4). It is a process of its own:
for a surface that it cannot parametrise gmsh may take any time, or end its process.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

from ..typing import Array, Integers
from .thresholds import DEFAULT

_TETRAHEDRON, _TRIANGLE = 4, 2
"""Gmsh's element types."""


def main() -> None:
    """Mesh what the first file describes into the second."""
    import gmsh

    given = np.load(sys.argv[1])
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    _add_volume(gmsh, given["points"], given["triangles"])
    _set_sizes(gmsh, given["places"], given["sizes"])
    gmsh.model.mesh.generate(3)
    points, cells = _volume_mesh(gmsh)
    np.savez(sys.argv[2], points=points, cells=cells)


def _add_volume(gmsh: Any, points: Array, triangles: Integers) -> None:
    """Give gmsh the patches of the surface, parted at its edges, and the volume within."""
    mesh = gmsh.model.mesh
    gmsh.model.addDiscreteEntity(2, 1)
    mesh.addNodes(2, 1, np.arange(1, len(points) + 1), points.ravel())
    mesh.addElementsByType(1, _TRIANGLE, [], (triangles + 1).ravel())
    mesh.classifySurfaces(2.0 * DEFAULT.outline_turn, True, True, math.pi)
    mesh.createGeometry()
    loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
    gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()


def _set_sizes(gmsh: Any, places: Array, sizes: Array) -> None:
    """Ask for cells of these sizes, everywhere that of the nearest place."""
    for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
    from scipy.spatial import cKDTree

    tree = cKDTree(places)
    gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, size: float(sizes[tree.query((x, y, z))[1]]))


def _volume_mesh(gmsh: Any) -> tuple[Array, Integers]:
    """Vertices (n, 3) and cells (c, 4) of the volume."""
    tags, flat, _ = gmsh.model.mesh.getNodes()
    corners = gmsh.model.mesh.getElementsByType(_TETRAHEDRON)[1].astype(np.int64)
    used, cells = np.unique(corners, return_inverse=True)
    place = np.empty(int(np.max(tags)) + 1, dtype=np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))
    return np.asarray(flat.reshape(-1, 3)[place[used]]), cells.reshape(-1, 4)


if __name__ == "__main__":
    main()
