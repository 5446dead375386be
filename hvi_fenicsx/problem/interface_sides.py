"""The two sides of an interface: their facets, the same on all ranks, and where they lie over each other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI

from ..errors import InputError
from ..geometry import spot
from ..mesh import curved as curved_cells
from ..mesh import nodes
from ..mesh.boundary_part import InterfaceSides
from ..mesh.facets import cell_facets
from ..runtime.mpi import agree
from ..typing import Array, Entities, Mask
from . import curved_overlaps, facet_overlaps, facet_polygons, spaces
from .contact_surface import Surface
from .domain_forms import DomainForms
from .facet_overlaps import Facets, Overlaps, is_curved
from .scaling import DEFAULT


def refuse(comm: MPI.Comm, surfaces: Iterable[Surface], length: float) -> None:
    """Refuse a part with two vertices at one point whose outward normals face each other. Collective.

    Args:
        comm: the ranks.
        surfaces: of the parts with contact or laws.
        length: of the body, m.

    Raises:
        InputError: on all ranks alike, with the first such point.
    """
    for surface in surfaces:
        gathered = agree(comm, (surface.points, surface.normals))
        points, normals = (np.concatenate(arrays) for arrays in zip(*gathered, strict=True))
        found = _facing(points, normals, DEFAULT.same * length)
        if found is not None:
            raise InputError(
                f"boundary.{surface.part}: two sides lie on each other at {spot(found[: normals.shape[1]])} and face "
                "each other. Contact and laws of a boundary part act between the body and a rigid obstacle: each side "
                "would be held by an obstacle of its own. Give the part one of the sides only, or name both "
                "in an [interface.NAME]"
            )


def _facing(points: Array, normals: Array, near: float) -> Array | None:
    """The first point (3,) that two vertices with opposite normals share; None: there is none."""
    from scipy.spatial import cKDTree

    if len(points) < 2:
        return None
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    facing = pairs[np.einsum("pi,pi->p", normals[pairs[:, 0]], normals[pairs[:, 1]]) < -0.5]
    return points[np.sort(facing.ravel())[0]] if len(facing) else None


@dataclass(frozen=True, kw_only=True)
class Pair:
    """The facets of the two sides of an interface, the same on all ranks.

    Attributes:
        name: of the interface.
        sides: what the scene says of it.
        first: the facets of the first side.
        second: those of the second.
        curved: whether facets are curved through their nodes, else segments or triangles.
    """

    name: str
    sides: InterfaceSides
    first: Facets
    second: Facets
    curved: bool = False

    def overlaps(self) -> Overlaps:
        """The intersections of the facets of both sides."""
        if self.first.points.shape[2] == 2:
            flat = curved_overlaps if self.curved else facet_overlaps
            return flat.in_plane(self.first, self.second)
        in_space = curved_overlaps.in_space if self.curved else facet_polygons.in_space
        return in_space(self.first, self.second)

    def covered(self, overlaps: Overlaps) -> Mask:
        """Whether each node of the first side lies over the second, a midpoint with both ends of its edge, (f, n)."""
        middles = [overlaps.covered[:, ends].all(axis=1) for ends in self.first.edges]
        return np.column_stack([overlaps.covered, *middles])

    def members(self, context: DomainForms) -> Entities:
        """Local vertices (owned) of both sides."""
        start, end = context.space.dofmap.index_map.local_range
        both = np.unique(np.concatenate([self.first.nodes.ravel(), self.second.nodes.ravel()]))
        return np.asarray(both[(both >= start) & (both < end)] - start, dtype=np.int32)


def pair(context: DomainForms, name: str, sides: InterfaceSides) -> Pair:
    """The facets of both sides on all ranks. Collective.

    Args:
        context: spaces, parts and vertices.
        name: of the interface.
        sides: what the scene says of it.

    Raises:
        InputError: on all ranks alike: a side without facets.
    """
    found = []
    for side in (sides.first, sides.second):
        facets = _gathered(context, context.domain.facets([side]))
        if not len(facets.nodes):
            raise InputError(f"interface.{name}.between: no facet lies on {side!r}")
        found.append(facets)
    curved = is_curved(context.space) and any(curved_cells.is_curved(facets.points) for facets in found)
    return Pair(name=name, sides=sides, first=found[0], second=found[1], curved=curved)


def _gathered(context: DomainForms, local: Entities) -> Facets:
    """Facets whose cells this rank owns, and those of all other ranks. Collective."""
    space, d = context.space, context.dimension
    of_cell, topology = cell_facets(context.domain.mesh), context.domain.mesh.topology
    connected = topology.connectivity(d - 1, d)
    local = local[np.diff(connected.offsets)[local] == 1]
    cells = connected.array[connected.offsets[local]]
    owned = cells < topology.index_map(d).size_local
    local, cells = local[owned], cells[owned]
    blocks = nodes.facet_nodes(space, local)
    inner = space.dofmap.list[cells][:, : d + 1][of_cell[cells] == local[:, None]]
    parts = [
        space.dofmap.index_map.local_to_global(np.ascontiguousarray(blocks.ravel())).reshape(blocks.shape),
        (context.points if is_curved(space) else context.points_on_curves)[blocks][:, :, :d],
        outward(context.points[blocks[:, :d]][:, :, :d], context.points[inner][:, :d]),
    ]
    every = agree(context.domain.mesh.comm, parts)
    numbers, points, normals = (np.concatenate([part[i] for part in every]) for i in range(3))
    order = np.lexsort(np.round(points[:, :d].mean(axis=1) / context.length, 12).T)
    return Facets(
        nodes=numbers[order].astype(np.int64),
        points=points[order],
        normals=normals[order],
        share=spaces.edge_share(space),
    )


def outward(corners: Array, inner: Array) -> Array:
    """The unit normals of segments or triangles away from points inside, (f, d).

    Args:
        corners: of the facets, (f, d, d).
        inner: points inside, (f, d).
    """
    sides = corners[:, 1:] - corners[:, :1]
    plane = corners.shape[1] == 2
    across = np.column_stack([sides[:, 0, 1], -sides[:, 0, 0]]) if plane else np.cross(sides[:, 0], sides[:, 1])
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(normals * -np.sign(np.sum(normals * (inner - corners[:, 0]), axis=1, keepdims=True)))
