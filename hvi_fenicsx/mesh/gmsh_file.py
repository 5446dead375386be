"""Gmsh files (.msh, .geo) as domains: sides and regions by the names of physical groups."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..errors import InputError
from ..geometry import Outline
from ..runtime import cost, processes
from ..runtime.log import logger
from ..runtime.mpi import on_root
from ..schema import LONGEST, SHORTEST
from ..typing import Entities
from . import curved, gmsh_process
from .domain import DEFAULT, Domain, check_affordable
from .gmsh_arrays import MeshArrays, extract, session

_LOG = logger("mesh")
_SCRIPTS = (".geo", ".geo_unrolled")
_HEADER = b"$MeshFormat"
"""How a mesh begins; all else gmsh would take for a script."""


def read(comm: MPI.Comm, path: Path, dimension: int, scale: float = 1.0) -> Domain:
    """The mesh of a file, its physical groups being sides and regions. Collective.

    Args:
        comm: the ranks that share the mesh.
        path: the file.
        dimension: of the cells, 2 or 3.
        scale: m per unit of the file's coordinates.

    Raises:
        InputError: on all ranks alike: not readable, no mesh nor harmless script, no named groups, wrong dimension, no
            simplices of order 1 or 2, inverted or degenerate cells.
        Interrupted: on all ranks alike: a signal came.
    """
    found: list[MeshArrays] = []
    names, vertices = on_root(comm, lambda: _read(path, dimension, scale, found))
    check_affordable(comm, dimension * vertices, dimension, "domain.file", "mesh the body coarser")
    mesh, sides, regions = distribute(comm, found, dimension, names)
    mesh.geometry.x[:] *= scale
    return Domain.from_mesh(*curved.straightened(mesh, sides, regions, f"mesh file {path}"))


def _read(path: Path, dimension: int, scale: float, found: list[MeshArrays]) -> tuple[dict[int, dict[str, int]], int]:
    """Read the file in a process of its own. Rank 0 only.

    Args:
        path: the file.
        dimension: of the cells.
        scale: m per unit of the file's coordinates.
        found: the mesh is added here.

    Returns:
        The physical groups by dimension and name, and the number of vertices.
    """
    kind = "script" if _is_script(path) else "mesh"
    memory = DEFAULT.gmsh_share * cost.free_memory()
    words = [str(path.absolute()), kind, str(dimension), str(memory)]
    _LOG.info("gmsh reads or meshes %s", path, extra={"moving": True})
    try:
        done = processes.run(gmsh_process.__name__, words, DEFAULT.gmsh_seconds)
    except subprocess.TimeoutExpired:
        text = (
            f"gmsh has not done with it after {DEFAULT.gmsh_seconds:g} s; look for an endless loop, or give "
            "the .msh that gmsh saves"
        )
        raise InputError(f"mesh file {path}: {text}") from None
    if done.returncode == os.EX_OSERR or b"lost sys.stderr" in done.stderr:
        much = f"more than the {memory / 1024:.2g} GB that it may use"
        raise InputError(f"mesh file {path}: gmsh wants {much}; look for a count or a size that makes too many cells")
    if done.returncode or not done.stdout:
        raise InputError(f"mesh file {path}: {_end(done)}")
    with np.load(io.BytesIO(done.stdout)) as arrays:
        if "fault" in arrays:
            raise InputError(str(arrays["fault"]))
        mesh = MeshArrays(**{name: arrays[name] for name in MeshArrays.__annotations__})
        names = {int(d): named for d, named in json.loads(str(arrays["names"])).items()}
    length = float(np.max(np.ptp(mesh.points, axis=0))) * scale
    if not SHORTEST <= length <= LONGEST:
        allowed = f"{SHORTEST:g} to {LONGEST:g} m; it is the length in m of one unit of the file"
        raise InputError(f"domain.scale: makes the body {length:.1e} m long; allowed is {allowed}")
    found.append(mesh)
    return names, len(np.unique(mesh.cells[:, : dimension + 1]))


def _is_script(path: Path) -> bool:
    """Whether the file is a script, and not a mesh.

    Raises:
        InputError: it is neither.
    """
    if not path.is_file():
        raise InputError(f"mesh file {path}: there is no such file; give the path from the scene's folder")
    if path.suffix in _SCRIPTS:
        return True
    with path.open("rb") as stream:
        if stream.read(len(_HEADER)) != _HEADER:
            way = "save it by gmsh, convert it by meshio (--output-format gmsh), or name a script .geo"
            raise InputError(f"mesh file {path}: is no mesh: it does not begin with {_HEADER.decode()}; {way}")
    return False


def _end(done: subprocess.CompletedProcess[bytes]) -> str:
    """Why gmsh came to an end without a mesh."""
    if done.returncode == 0 or not done.stderr.strip():
        code = done.returncode
        how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return f"it ended gmsh ({how}); remove Exit and Abort, and see whether gmsh itself can mesh it"
    last = done.stderr.decode(errors="replace").strip().splitlines()[-1]
    return f"gmsh cannot read it: {last[:200]}"


def distribute(
    comm: MPI.Comm, given: list[MeshArrays], dimension: int, names: Mapping[int, Mapping[str, int]]
) -> tuple[dmesh.Mesh, dict[str, Entities], dict[str, Entities]]:
    """A mesh that rank 0 has, shared among the ranks. Collective.

    Args:
        comm: the ranks.
        given: the mesh, which is taken out; nothing on the other ranks.
        dimension: of the cells.
        names: physical groups of facets and of cells with their tags, by dimension; on all ranks.

    Returns:
        Mesh, sides and regions (local facets and cells by name).
    """
    own = given.pop() if given else None
    found = own or MeshArrays(*comm.bcast(None))
    if own is not None:
        comm.bcast([array[:0] for array in vars(own).values()])
    degree = 1 if found.cells.shape[1] == dimension + 1 else 2
    kind = "triangle" if dimension == 2 else "tetrahedron"
    mesh = compat.simplex_mesh(comm, found.cells, found.points[:, :dimension], kind, spread=True, degree=degree)
    cells = np.arange(mesh.topology.index_map(dimension).size_local, dtype=np.int32)
    tags = comm.bcast(found.cell_tags)[mesh.topology.original_cell_index[cells]]
    local, marks = compat.local_entities(mesh, dimension - 1, found.facets, found.facet_tags)
    return mesh, _by_name(local, marks, names[dimension - 1]), _by_name(cells, tags, names[dimension])


def _by_name(entities: Entities, tags: Entities, names: Mapping[str, int]) -> dict[str, Entities]:
    """Local entities by the names of their tags."""
    return {name: np.unique(entities[tags == tag]) for name, tag in names.items()}


_BODY = "body"
_EXTENT = 1.6
"""The extent at which gmsh meshes each outline."""
_DIGITS = 13
"""Decimals of the lengths that gmsh is given; what is rounding in them depends on the units."""


def build(comm: MPI.Comm, outline: Outline, size: float) -> Domain:
    """The body within an outline; its sides have the outline's names and curves. Collective.

    Args:
        comm: the ranks that share the mesh.
        outline: its boundary, with the size of cells at its corners.
        size: the size of cells elsewhere, m.

    Raises:
        InputError: on all ranks alike, when gmsh cannot mesh the shape.
    """
    unit, found = outline.extent / _EXTENT, list[MeshArrays]()
    names = on_root(comm, lambda: _meshed(outline.in_units(unit, _DIGITS), round(size / unit, _DIGITS), found))
    mesh, sides, _ = distribute(comm, found, 2, names)
    mesh.geometry.x[:] *= unit
    return Domain.from_mesh(mesh, sides, curves=outline.arcs(), one_piece=True)


def _meshed(outline: Outline, size: float, found: list[MeshArrays]) -> dict[int, dict[str, int]]:
    """Mesh the outline in gmsh, and add the mesh; its physical groups by dimension and name. Rank 0 only."""
    with session() as gmsh:
        names = _drawn(gmsh, outline, size)
        # Along an edge and inward the size is interpolated between the corners, so a fine corner stays local.
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
        try:
            gmsh.model.mesh.generate(2)
        except Exception as error:
            # gmsh raises bare Exceptions, whatever went wrong
            raise InputError(f"domain: gmsh cannot mesh the shape: {error}; change mesh_size") from None
        found.append(extract(gmsh, 2))
    return names


def _drawn(gmsh: Any, outline: Outline, size: float) -> dict[int, dict[str, int]]:
    """Draw the outline in gmsh; its physical groups by dimension and name."""
    geo = gmsh.model.geo
    corners = [geo.addPoint(x, y, 0.0, h) for (x, y), h in zip(outline.points, outline.sizes, strict=True)]
    centres = {c: geo.addPoint(*c, 0.0, size) for _, c in outline.sides if c is not None}
    edges: dict[str, list[int]] = {}
    for i, (name, centre) in enumerate(outline.sides):
        ends = corners[i], corners[(i + 1) % len(corners)]
        edge = geo.addLine(*ends) if centre is None else geo.addCircleArc(ends[0], centres[centre], ends[1])
        edges.setdefault(name, []).append(edge)
    loop = geo.addCurveLoop([edge for found in edges.values() for edge in found], reorient=True)
    surface = geo.addPlaneSurface([loop])
    geo.synchronize()
    groups = {name: gmsh.model.addPhysicalGroup(1, found, name=name) for name, found in edges.items()}
    body = gmsh.model.addPhysicalGroup(2, [surface], name=_BODY)
    return {1: groups, 2: {_BODY: body}}
