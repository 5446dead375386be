"""A dolfinx mesh with tags, as a user's program brings it, checked and turned into a domain."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from dolfinx import mesh as dmesh

from .. import compat
from ..errors import InputError
from ..geometry import spot
from ..runtime.mpi import agree, refuse
from ..typing import Entities
from . import curved
from .domain import Domain
from .gmsh_arrays import folded_cells

_SIMPLICES = ("triangle", "tetrahedron")


def domain_of(
    mesh: dmesh.Mesh, facets: Any, cells: Any, sides: Mapping[str, int], regions: Mapping[str, int]
) -> Domain:
    """The domain of a mesh with tags. Collective.

    Cells of second order become straight, as those of a mesh file do; the facets of the sides remain as curves.

    Args:
        mesh: of triangles or tetrahedra of order 1 or 2, in m.
        facets: tags of facets, or None.
        cells: tags of cells, or None.
        sides: tags of facets by the names of the sides.
        regions: tags of cells by the names of the regions.

    Raises:
        InputError: on all ranks alike, with what is wrong and how to mend it.
    """
    _check_cells(mesh)
    _check_nodes(mesh)
    d = mesh.topology.dim
    mesh.topology.create_connectivity(d - 1, d)
    if regions and cells is None:
        raise InputError(
            f"body: the region {next(iter(regions))!r} is named, but no tags of cells are given: cells=..."
        )
    if sides and facets is None:
        raise InputError(f"body: {next(iter(sides))!r} is a side, but no tags of facets are given: facets=...")
    named_sides = _named(mesh, facets, d - 1, sides)
    _check_outer(mesh, named_sides)
    return Domain.from_mesh(*curved.straightened(mesh, named_sides, _named(mesh, cells, d, regions), "body"))


def check_tags(**given: Any) -> None:
    """Refuse what is no mesh tags.

    Args:
        **given: tags, or None, by the name of the argument.

    Raises:
        InputError: another kind of object.
    """
    for name, tags in given.items():
        if tags is not None and (not isinstance(tags, dmesh.MeshTags) or tags.values.dtype.kind != "i"):
            raise InputError(
                f"body: {name} are of the kind {type(tags).__name__}; give dolfinx.mesh.MeshTags of whole numbers, as "
                "meshtags(mesh, dimension, entities, values) makes them"
            )


def tags_present(mesh: dmesh.Mesh, tags: Any) -> set[int]:
    """All tags that some entity of any rank has. Collective.

    Args:
        mesh: the mesh.
        tags: its tags, or None.
    """
    own = set() if tags is None else {int(tag) for tag in np.unique(tags.values)}
    return set().union(*agree(mesh.comm, own))


def _check_cells(mesh: dmesh.Mesh) -> None:
    kind, d = mesh.topology.cell_name(), mesh.geometry.dim
    if kind not in _SIMPLICES:
        raise InputError(
            f"body: the mesh has cells of the kind {kind}; the program solves on triangles and tetrahedra: make the "
            "mesh with CellType.triangle or CellType.tetrahedron, in gmsh without Recombine"
        )
    if mesh.topology.dim != d:
        raise InputError(
            f"body: the mesh has cells of dimension {mesh.topology.dim} in {d} coordinates; give as many coordinates "
            f"as dimensions, such as gdim={mesh.topology.dim} where the mesh is read"
        )
    if (degree := compat.geometry_degree(mesh)) > 2:
        raise InputError(
            f"body: the cells are of order {degree}; give a mesh of order 1 or 2 (gmsh: Mesh.ElementOrder)"
        )


def _check_nodes(mesh: dmesh.Mesh) -> None:
    """Refuse nodes that are no points, or fold the mesh. Collective."""
    d, x = mesh.geometry.dim, mesh.geometry.x
    refuse(mesh.comm, ["body: a coordinate of the mesh is no finite number"] * (not np.all(np.isfinite(x))))
    points, cells = x[:, :d], compat.geometry_dofmap(mesh)[:, : d + 1].astype(np.int64)
    folded = folded_cells(points, cells)
    middles = (spot(points[cells[k]].mean(axis=0)) for k in folded[:1])
    text = "cells lie over each other there; move its vertices"
    refuse(mesh.comm, (f"body: the mesh is folded at {middle}: {text}" for middle in middles))


def _named(mesh: dmesh.Mesh, tags: Any, dimension: int, names: Mapping[str, int]) -> dict[str, Entities]:
    """Local entities by name. Collective."""
    if tags is None:
        return {}
    kind = "cells" if dimension == mesh.topology.dim else "facets"
    if tags.dim != dimension:
        raise InputError(f"body: {kind} are tags of dimension {tags.dim}; {kind} of this mesh have {dimension}")
    if tags.topology != mesh.topology._cpp_object:
        raise InputError(f"body: {kind} are tags of another mesh; make them with meshtags(mesh, {dimension}, ...)")
    index_map = mesh.topology.index_map(dimension)
    count = index_map.size_local + index_map.num_ghosts
    beyond = np.setdiff1d(tags.indices, np.arange(count))
    refuse(mesh.comm, (f"body: {kind}: the mesh has no {kind[:-1]} {i}, there are {count}" for i in beyond[:1]))
    present = tags_present(mesh, tags)
    for name, tag in names.items():
        if tag not in present:
            known = ", ".join(map(str, sorted(present))) or "none"
            raise InputError(f"body: {name!r} is the tag {tag} of {kind}, which no entity has; there are: {known}")
    return {name: tags.find(tag) for name, tag in names.items()}


def _check_outer(mesh: dmesh.Mesh, sides: Mapping[str, Entities]) -> None:
    cells = np.diff(mesh.topology.connectivity(mesh.topology.dim - 1, mesh.topology.dim).offsets)
    text = "has facets inside of the body; tag facets of its surface only (dolfinx.mesh.exterior_facet_indices)"
    inner = (name for name, facets in sides.items() if np.any(cells[facets] > 1))
    refuse(mesh.comm, (f"body: the side {name!r} {text}" for name in inner))
