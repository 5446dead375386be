"""How a mesh that gmsh has made becomes a dolfinx mesh: sides and regions are its named physical groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..errors import InputError
from ..geometry import Outline
from ..runtime.mpi import on_root
from ..typing import Entities
from .domain import Domain
from .gmsh_arrays import MeshArrays, extract, start


@contextmanager
def session(comm: MPI.Comm) -> Iterator[Any]:
    """The gmsh module, started on rank 0 only (None elsewhere) and always finalised."""
    if comm.rank != 0:
        yield None
        return
    import gmsh

    start(gmsh)
    try:
        yield gmsh
    finally:
        gmsh.finalize()


def distribute(
    comm: MPI.Comm, found: MeshArrays | None, dimension: int, names: Mapping[int, Mapping[str, int]]
) -> tuple[dmesh.Mesh, dict[str, Entities], dict[str, Entities]]:
    """A mesh that rank 0 has, shared among the ranks. Collective.

    Args:
        comm: the ranks.
        found: the mesh; None on the other ranks.
        dimension: of the cells.
        names: physical groups of facets and of cells with their tags, by dimension; on all ranks.

    Returns:
        Mesh, sides and regions (local facets and cells by name).
    """
    found = found or MeshArrays.empty(dimension)
    kind = "triangle" if dimension == 2 else "tetrahedron"
    mesh = compat.simplex_mesh(comm, found.cells, found.points[:, :dimension], kind, spread=True)
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
    unit = outline.extent / _EXTENT
    with session(comm) as gmsh:
        names = on_root(comm, lambda: _meshed(gmsh, outline.in_units(unit, _DIGITS), round(size / unit, _DIGITS)))
        mesh, sides, _ = distribute(comm, gmsh and extract(gmsh, 2), 2, names)
    mesh.geometry.x[:] *= unit
    return Domain.from_mesh(mesh, sides, curves=outline.arcs(), one_piece=True)


def _meshed(gmsh: Any, outline: Outline, size: float) -> dict[int, dict[str, int]]:
    """Mesh the outline in gmsh; its physical groups by dimension and name. Rank 0 only."""
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
    _generate(gmsh)
    return {1: groups, 2: {_BODY: body}}


def _generate(gmsh: Any) -> None:
    # Along an edge and inward the size is interpolated between the corners, so a fine corner stays local.
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
    try:
        gmsh.model.mesh.generate(2)
    except Exception as error:
        # gmsh raises bare Exceptions, whatever went wrong
        raise InputError(f"domain: gmsh cannot mesh the shape: {error}; change mesh_size") from None
