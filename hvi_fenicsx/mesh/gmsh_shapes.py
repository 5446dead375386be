"""Plane bodies meshed by gmsh on rank 0 within an outline. SI.

Gmsh's mesh depends on the last digits of what it is given. So it meshes each outline at one extent, with rounded
lengths; then a body has the same mesh in any units of length.
"""

from __future__ import annotations

from typing import Any

from mpi4py import MPI

from ..errors import InputError
from ..geometry import Outline
from ..runtime.mpi import on_root
from . import gmsh_arrays, gmsh_model
from .domain import Domain

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
    with gmsh_model.session(comm) as gmsh:
        names = on_root(comm, lambda: _meshed(gmsh, outline.in_units(unit, _DIGITS), round(size / unit, _DIGITS)))
        mesh, sides, _ = gmsh_model.distribute(comm, gmsh and gmsh_arrays.extract(gmsh, 2), 2, names)
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
