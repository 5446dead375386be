"""A gmsh file read, meshed and checked: ``python3 -m hvi_fenicsx.mesh.gmsh_reader REQUEST`` prints the mesh.

REQUEST is JSON, see :class:`Request`; what is printed is an npz: the arrays of :class:`.gmsh_arrays.MeshArrays` and,
as JSON, ``names``, the tags of the physical groups by dimension and name; or ``fault``, what is wrong with the file.

It is a process of its own since gmsh reads all kinds of programs: whatever a file holds, from the moment on that it is
opened nothing can be started or written (:mod:`..runtime.processes`). Where the system cannot see to that, no
script is opened.
"""

from __future__ import annotations

import io
import json
import os
import signal
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..runtime import processes
from ..typing import Array, Entities, Integers
from . import cell_checks, gmsh_arrays

_LINKED = "mesh.msh"


@dataclass(frozen=True, kw_only=True)
class Request:
    """What is to be read.

    Attributes:
        path: of the file.
        is_script: whether it is a script; else it is a mesh.
        dimension: of the cells, 2 or 3.
        memory: what may be used, MB.
    """

    path: str
    is_script: bool
    dimension: int
    memory: float

    def dumps(self) -> str:
        """As text."""
        return json.dumps(asdict(self))

    @classmethod
    def loads(cls, text: str) -> Request:
        """From that text."""
        found = json.loads(text)
        return cls(**found)


def main() -> None:
    """Print the mesh that the request wants."""
    processes.die_with_parent(signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Python's own handler would wait for gmsh
    result = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what a script prints is no part of the result
    result.write(_packed(Request.loads(sys.argv[1])))
    result.close()


def _packed(request: Request) -> bytes:
    buffer = io.BytesIO()
    try:
        np.savez(buffer, **_read(request))
    except InputError as error:
        np.savez(buffer, fault=np.array(str(error)))
    return buffer.getvalue()


def _read(request: Request) -> dict[str, Any]:
    """The arrays of the mesh, and its names as JSON.

    Raises:
        InputError: gmsh cannot read the file, or the mesh cannot be used.
    """
    import gmsh

    gmsh_arrays.start(gmsh)
    path, dimension = Path(request.path), request.dimension
    opened = path if request.is_script else _linked(path)
    if not processes.confine(request.memory) and request.is_script:
        raise InputError(
            f"mesh file {path}: is a script, which may run programs, and this system cannot forbid it (Linux can from "
            "5.13 on, by Landlock); mesh it by gmsh and give the .msh that it saves"
        )
    try:
        _open(gmsh, opened, dimension)
    except Exception as error:
        # gmsh raises bare Exceptions, whatever is wrong with a file
        reason = str(error).replace(str(opened), str(path))
        if "Out of memory" in reason:
            reason = f"it wants more than the {request.memory / 1024:.2g} GB that it may use; make it smaller"
        raise InputError(f"mesh file {path}: gmsh cannot read it: {reason}") from None
    curves = straightened(gmsh, path, dimension)
    gmsh_arrays.check(gmsh, path, dimension)
    names = {d: _names(gmsh, path, d) for d in (dimension - 1, dimension)}
    found = gmsh_arrays.extract(gmsh, dimension, curves)
    return {**{name: getattr(found, name) for name in found.__annotations__}, "names": np.array(json.dumps(names))}


def _linked(path: Path) -> Path:
    """The mesh by another name: gmsh chooses by names what it does, and would read options beside the file."""
    os.symlink(path, _LINKED)
    return Path(_LINKED)


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
        line = path.read_bytes().partition(error.object)[0].count(b"\n") + 1
        raise InputError(
            f"mesh file {path}:{line}: the name {shown!r} is not in UTF-8; save the file as UTF-8"
        ) from None


_QUADRATIC = {1: 8, 2: 9, 3: 11}
"""Gmsh's element type of the simplex of second order, by dimension."""
_ORDER = {1: [0, 1, 2], 2: [0, 1, 2, 4, 5, 3]}
"""Where basix has the nodes of a facet, by its dimension."""


def straightened(gmsh: Any, path: Path, dimension: int) -> tuple[Array, Entities]:
    """Make a mesh of second order one of first order; its curved facets (k, n, 3), and their groups (k,).

    Facets of a group all of whose midpoints are in the middle of their edges are left out.

    Args:
        gmsh: the module, the file being open in it.
        path: of the file, for messages.
        dimension: of the cells, 2 or 3.

    Raises:
        InputError: a midpoint is so far from the middle of its edge that the curve turns back.
    """
    cells = set(gmsh.model.mesh.getElements(dimension)[0]) if gmsh.model.getDimension() == dimension else set()
    if cells != {_QUADRATIC[dimension]}:
        return gmsh_arrays.no_curves(dimension)
    found = [_facets(gmsh, path, dimension - 1, group) for _, group in gmsh.model.getPhysicalGroups(dimension - 1)]
    gmsh.model.mesh.setOrder(1)
    gmsh_arrays.close_gaps(gmsh)
    points, groups = zip(gmsh_arrays.no_curves(dimension), *found, strict=True)
    return np.concatenate(points), np.concatenate(groups)


def _facets(gmsh: Any, path: Path, dimension: int, group: int) -> tuple[Array, Entities]:
    """The facets of a group and the group of each; none where they are straight.

    Raises:
        InputError: a midpoint is too far from the middle of its edge.
    """
    tags, points, _ = gmsh.model.mesh.getNodes()
    place = dict(zip(tags.tolist(), points.reshape(-1, 3), strict=True))
    rows: list[Integers] = [np.empty((0, len(_ORDER[dimension])), dtype=np.int64)]
    for entity in gmsh.model.getEntitiesForPhysicalGroup(dimension, group):
        for kind, _, nodes in zip(*gmsh.model.mesh.getElements(dimension, entity), strict=True):
            if kind == _QUADRATIC[dimension]:
                rows.append(np.asarray(nodes, dtype=np.int64).reshape(-1, len(_ORDER[dimension])))
    nodes = np.concatenate(rows)[:, _ORDER[dimension]]
    found = np.array([[place[node] for node in facet] for facet in nodes.tolist()]).reshape(*nodes.shape, 3)
    if len(bad := cell_checks.turning_back(found)):
        names = ", ".join(map(str, nodes[bad[0]]))
        raise InputError(f"mesh file {path}: the boundary element of nodes {names} has a {cell_checks.TURNING_BACK}")
    if not cell_checks.is_curved(found):
        found = found[:0]
    return found, np.full(len(found), group, dtype=np.int32)


if __name__ == "__main__":
    main()
