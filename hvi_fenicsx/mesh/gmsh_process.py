"""Gmsh in a process of its own: ``python3 -m hvi_fenicsx.mesh.gmsh_process`` prints a mesh as npz.

FILE KIND DIMENSION MEMORY: a gmsh file read, meshed and checked. KIND is "script" or "mesh", MEMORY what may be used in
MB; printed are the arrays of :class:`.gmsh_arrays.MeshArrays` and, as JSON, ``names``, the tags of the physical groups
by dimension and name; or ``fault``, what is wrong with the file. Gmsh reads all kinds of programs: whatever a file
holds, from the moment on that it is opened nothing can be started or written (:mod:`..runtime.processes`). Where
the system cannot see to that, no script is opened.

SURFACE.npz: a body in space meshed anew within its surface. It holds ``points`` (n, 3), ``triangles`` (t, 3),
counterclockwise as seen from outside, the ``turn`` (radian) from which on two of them meet at an edge, ``places``
(k, 3) and the ``sizes`` (k,) of cells wanted near them; printed are ``points`` and ``cells`` (c, 4).
"""

from __future__ import annotations

import io
import json
import math
import os
import signal
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..runtime import processes
from ..typing import Array, Integers
from . import gmsh_arrays

_LINKED = "mesh.msh"
_TRIANGLE = 2
"""Gmsh's element type."""


def main() -> None:
    """Print the mesh that is wanted."""
    processes.die_with_parent(signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Python's own handler would wait for gmsh
    result = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what a script prints is no part of the result
    buffer = io.BytesIO()
    try:
        np.savez(buffer, **_wanted(*sys.argv[1:]))
    except InputError as error:
        np.savez(buffer, fault=np.array(str(error)))
    except MemoryError:
        sys.exit(os.EX_OSERR)
    result.write(buffer.getvalue())
    result.close()


def _wanted(file: str, *words: str) -> dict[str, Any]:
    """The arrays of the mesh.

    Raises:
        InputError: gmsh cannot read the file, or the mesh cannot be used.
    """
    with gmsh_arrays.session() as gmsh:
        if not words:
            points, cells = _within_surface(gmsh, np.load(file))
            return {"points": points, "cells": cells}
        kind, dimension, memory = words
        return _read(gmsh, Path(file), kind == "script", int(dimension), float(memory))


def _read(gmsh: Any, path: Path, is_script: bool, dimension: int, memory: float) -> dict[str, Any]:
    opened = path if is_script else Path(_LINKED)
    if not is_script:  # gmsh chooses by names what it does, and would read options beside the file
        os.symlink(path, opened)
    if not processes.confine(memory) and is_script:
        raise InputError(
            f"mesh file {path}: is a script, which may run programs, and this system cannot forbid it (Linux can from "
            "5.13 on, by Landlock); mesh it by gmsh and give the .msh that it saves"
        )
    try:
        _open(gmsh, opened, dimension)
    except Exception as error:
        # gmsh raises bare Exceptions, whatever is wrong with a file
        reason = str(error).replace(str(opened), str(path))
        if "Out of memory" in reason or not reason:  # of an allocation that fails nothing is said
            raise MemoryError from None
        raise InputError(f"mesh file {path}: gmsh cannot read it: {reason}") from None
    found = gmsh_arrays.check(gmsh, path, dimension)
    names = {d: _names(gmsh, path, d) for d in (dimension - 1, dimension)}
    return {**vars(found), "names": np.array(json.dumps(names))}


def _open(gmsh: Any, path: Path, dimension: int) -> None:
    gmsh.open(str(path))
    if not len(gmsh.model.mesh.getNodes()[0]):
        gmsh.model.mesh.generate(dimension)
    if gmsh.model.getNumberOfPartitions():
        gmsh.model.mesh.unpartition()  # the ranks are shared out anew
    gmsh_arrays.close_gaps(gmsh)  # a file may have lost some nodes with their cells


def _names(gmsh: Any, path: Path, dimension: int) -> dict[str, int]:
    """Tags of the physical groups of a dimension by name; a nameless one is called by its tag."""
    named = {_name(gmsh, path, d, tag): tag for d, tag in gmsh.model.getPhysicalGroups(dimension)}
    for name, tag in named.items():
        if not len(gmsh.model.mesh.getNodesForPhysicalGroup(dimension, tag)[0]):
            raise InputError(f"mesh file {path}: physical group {name!r} is empty; remove it or fill it")
    if not named:
        kind = "region" if dimension == gmsh.model.getDimension() else "boundary part"
        raise InputError(f"mesh file {path}: no physical group of dimension {dimension} (a {kind}); add one in gmsh")
    return named


def _name(gmsh: Any, path: Path, dimension: int, tag: int) -> str:
    try:
        return gmsh.model.getPhysicalName(dimension, tag) or str(tag)
    except UnicodeDecodeError as error:
        shown = error.object.decode("latin-1")
        raise InputError(f"mesh file {path}: the name {shown!r} is not in UTF-8; save the file as UTF-8") from None


def _within_surface(gmsh: Any, given: Any) -> tuple[Array, Integers]:
    """Vertices (n, 3) and cells (c, 4) within a surface, parted at its edges into patches."""
    mesh, points = gmsh.model.mesh, given["points"]
    gmsh.model.addDiscreteEntity(2, 1)
    mesh.addNodes(2, 1, np.arange(1, len(points) + 1), points.ravel())
    mesh.addElementsByType(1, _TRIANGLE, [], (given["triangles"] + 1).ravel())
    mesh.classifySurfaces(float(given["turn"]), True, True, math.pi)
    mesh.createGeometry()
    loop = gmsh.model.geo.addSurfaceLoop([tag for _, tag in gmsh.model.getEntities(2)])
    gmsh.model.geo.addVolume([loop])
    gmsh.model.geo.synchronize()
    _set_sizes(gmsh, given["places"], given["sizes"])
    return _meshed(gmsh, 3)


def _set_sizes(gmsh: Any, places: Array, sizes: Array) -> None:
    """Ask for cells of these sizes, everywhere that of the nearest place."""
    from scipy.spatial import cKDTree

    for option in ("ExtendFromBoundary", "FromPoints", "FromCurvature"):
        gmsh.option.setNumber(f"Mesh.MeshSize{option}", 0)
    tree = cKDTree(places)
    gmsh.model.mesh.setSizeCallback(lambda dim, tag, x, y, z, size: float(sizes[tree.query((x, y, z))[1]]))


def within(rings: Sequence[Array]) -> tuple[Array, Integers]:
    """Vertices (n, 3) and triangles (c, 3) within an outline, each of whose edges is one of a triangle.

    Args:
        rings: the outline, then its holes, by their vertices, the first one last again, (n, 2).
    """
    with gmsh_arrays.session() as gmsh:
        geo, loops = gmsh.model.geo, []
        for ring in rings:
            points = [geo.addPoint(float(x), float(y), 0.0) for x, y in ring[:-1]]
            loops.append(geo.addCurveLoop([geo.addLine(*ends) for ends in pairwise([*points, points[0]])]))
        geo.addPlaneSurface(loops)
        geo.synchronize()
        for _, line in gmsh.model.getEntities(1):
            gmsh.model.mesh.setTransfiniteCurve(line, 2)
        return _meshed(gmsh, 2)


def _meshed(gmsh: Any, dimension: int) -> tuple[Array, Integers]:
    gmsh.model.mesh.generate(dimension)
    gmsh_arrays.close_gaps(gmsh)
    _, corners = gmsh.model.mesh.getElements(dimension)[1:]
    used, cells = np.unique(np.concatenate(corners).astype(np.int64) - 1, return_inverse=True)
    return gmsh_arrays.points(gmsh)[used], cells.reshape(-1, dimension + 1)


if __name__ == "__main__":
    main()
