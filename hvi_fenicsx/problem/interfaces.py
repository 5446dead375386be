"""Interfaces: where two bodies meet. The nodes of the first side carry laws of the relative displacement.

What carries nothing leaves its share to its neighbours (:mod:`.dual_basis`): nodes beyond the end of the second
side, and those that are prescribed, on another part with contact or laws, or on another interface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from ..errors import InputError
from ..geometry import tangents
from ..mesh import curved as curved_cells
from ..mesh import nodes
from ..mesh.boundary_part import InterfaceSides
from ..mesh.facets import cell_facets
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from . import dual_basis, facet_overlaps, spaces
from .contact_surface import Surface
from .domain_forms import DomainForms
from .dual_basis import RelativeRows
from .facet_overlaps import Overlaps
from .facets import Facets, is_curved, outward
from .scaling import DEFAULT


@dataclass(frozen=True)
class Pair:
    """The facets of the two sides of an interface, the same on all ranks.

    Attributes:
        name: of the interface.
        sides: what the scene says of it.
        first: the facets of the first side.
        second: those of the second.
    """

    name: str
    sides: InterfaceSides
    first: Facets
    second: Facets

    def covered(self, overlaps: Overlaps) -> Mask:
        """Whether each node of the first side lies over the second, a midpoint with both ends of its edge, (f, n)."""
        middles = [overlaps.covered[:, ends].all(axis=1) for ends in self.first.edges]
        return np.column_stack([overlaps.covered, *middles])


def _pair(context: DomainForms, name: str, sides: InterfaceSides) -> Pair:
    """The facets of both sides on all ranks; refuses a side without facets. Collective."""
    found = []
    for side in (sides.first, sides.second):
        facets = _gathered(context, context.domain.facets([side]))
        if not len(facets.nodes):
            raise InputError(f"interface.{name}.between: no facet lies on {side!r}")
        found.append(facets)
    curved = is_curved(context.space) and any(curved_cells.is_curved(facets.points) for facets in found)
    return Pair(name, sides, *(replace(facets, curved=curved) for facets in found))


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
        spaces.global_numbers(space, blocks),
        (context.points if is_curved(space) else context.points_on_curves)[blocks][:, :, :d],
        outward(context.points[blocks[:, :d]][:, :, :d], context.points[inner][:, :d]),
    ]
    every = agree(context.mesh.comm, parts)
    numbers, points, normals = (np.concatenate([part[i] for part in every]) for i in range(3))
    order = np.lexsort(np.round(points[:, :d].mean(axis=1) / context.length, 12).T)
    return Facets(
        nodes=numbers[order].astype(np.int64),
        points=points[order],
        normals=normals[order],
        share=spaces.edge_share(space),
    )


def check_carried(pair: Pair, overlaps: Overlaps, kept: Mask, busy: Mask) -> None:
    """Refuse an interface without a node that carries something, or a part of it that nothing carries.

    Args:
        pair: the sides.
        overlaps: the intersections of their facets.
        kept: which nodes of the first side's facets carry something, (f, n).
        busy: which lie over the second side and carry something else, (f, n).

    Raises:
        InputError: with the place.
    """
    if not kept.any():
        raise InputError(
            f'interface.{pair.name}.between: no vertex of "{pair.sides.first}" is free to carry contact or laws: each '
            f'lies beyond the end of "{pair.sides.second}", is prescribed, or is on another part; name the longer side '
            "second, or make the mesh of the first finer"
        )
    lost = np.setdiff1d(overlaps.first, np.flatnonzero(kept.any(axis=1) | ~busy.any(axis=1)))
    lost = np.setdiff1d(lost, list(dual_basis.adopted(pair.first, overlaps, kept)))
    if len(lost):
        at = tuple(float(f"{c:.6g}") for c in pair.first.corners[lost[0]].mean(axis=0))
        raise InputError(
            f"interface.{pair.name}: nothing carries the facet at {at}: its vertices and those near it are prescribed "
            "or on other parts; make the mesh there finer"
        )


def check_apart(comm: MPI.Comm, pair: Pair, surface: Surface, gap: Array) -> None:
    """Refuse bodies that overlap by more than the facets of their curved sides do. Collective.

    Args:
        comm: the ranks.
        pair: the sides.
        surface: the nodes of the first side that carry something.
        gap: the distance of the sides there, m, (m,).

    Raises:
        InputError: on all ranks alike, with the place where they overlap most.
    """
    deepest = [(float(gap[i]), surface.spot(i)) for i in np.argsort(gap)[:1]]
    depth, at = min((place for rank in agree(comm, deepest) for place in rank), default=(0.0, ""))
    if depth < -DEFAULT.overlap * pair.first.width:
        raise InputError(
            f'interface.{pair.name}.between: at {at} "{pair.sides.second}" lies {-depth:.3g} m inside of the body '
            f'of "{pair.sides.first}": move one of the bodies, name the sides that face each other, or mesh '
            "curved sides more finely"
        )


@dataclass(frozen=True, kw_only=True)
class Interface(Pair):
    """An interface on a mesh.

    Attributes:
        tied: the scalar dofs (owned and ghost) of relative displacements that are zero for ever.
        surface: the vertices of the first side that carry something, as a part with contact or laws has them.
        gap: the distance of the two sides as they are meshed, at these vertices, m, (m,).
        rows: what the relative displacement is made of, the same on all ranks.
        overlaps: the intersections of the facets.
        members: local vertices (owned) of both sides.
    """

    tied: Entities
    surface: Surface
    gap: Array
    rows: RelativeRows
    overlaps: Overlaps
    members: Entities


def find(context: DomainForms, wanted: Mapping[str, InterfaceSides], occupied: Entities) -> tuple[Interface, ...]:
    """The interfaces of a problem. Collective.

    Args:
        context: spaces, parts and vertices.
        wanted: what the scene says of each, by name.
        occupied: local vertices that are prescribed, or on a part with contact or laws.

    Raises:
        InputError: on all ranks alike: sides that do not face each other or overlap, or what is not supported.
    """
    if not wanted:
        return ()
    pairs = {name: _pair(context, name, sides) for name, sides in wanted.items()}
    taken = np.concatenate(agree(context.mesh.comm, spaces.global_numbers(context.space, occupied)))
    return tuple(_interface(context, name, pairs, taken) for name in wanted)


def _interface(context: DomainForms, name: str, pairs: Mapping[str, Pair], taken: Integers) -> Interface:
    """One interface: its intersections, which nodes of its first side carry something, normals, gaps. Collective.

    Nodes that are taken, by other interfaces too, or that the second side does not cover, carry nothing.
    """
    pair = pairs[name]
    overlaps = facet_overlaps.overlaps(pair.first, pair.second)
    if not len(overlaps.first):
        raise InputError(
            f'interface.{name}.between: "{pair.sides.first}" and "{pair.sides.second}" do not face each other: '
            "nowhere does a normal of the first meet a facet of the second; name sides that lie over each other"
        )
    others = [taken, pair.second.nodes.ravel()]
    others += [side.nodes.ravel() for n, p in pairs.items() if n != name for side in (p.first, p.second)]
    busy, covered = np.isin(pair.first.nodes, np.concatenate(others)), pair.covered(overlaps)
    kept = ~np.isin(pair.first.nodes, pair.first.nodes[~covered | busy])
    check_carried(pair, overlaps, kept, covered & busy)
    size = context.space.dofmap.index_map.size_global
    rows = dual_basis.relative_rows(pair.first, pair.second, overlaps, kept, size)
    surface = _surface(context, pair, overlaps, rows)
    gap = _gaps(context, surface, pair, rows)
    check_apart(context.mesh.comm, pair, surface, gap)
    start, end = context.space.dofmap.index_map.local_range
    both = np.union1d(pair.first.nodes, pair.second.nodes)
    return Interface(
        **vars(pair),
        tied=_dofs(context, surface) if pair.sides.tied else np.empty(0, np.int32),
        surface=surface,
        gap=gap,
        rows=rows,
        overlaps=overlaps,
        members=(both[(both >= start) & (both < end)] - start).astype(np.int32),
    )


def _surface(context: DomainForms, pair: Pair, overlaps: Overlaps, rows: RelativeRows) -> Surface:
    d, (start, end) = context.dimension, context.space.dofmap.index_map.local_range
    blocks = np.flatnonzero(rows.weights[start:end] > 0.0).astype(np.int32)
    sums, weights = _summed_normals(pair, overlaps, rows)
    mean = sums[start + blocks]
    normals = mean / np.linalg.norm(mean, axis=1, keepdims=True)
    rounded = np.round(normals)
    normals = np.where(np.abs(normals - rounded) < DEFAULT.rounding * 10, rounded, normals)
    return Surface(
        part=pair.name,
        facets=context.part_facets[pair.name],
        blocks=blocks,
        points=context.points[blocks],
        normals=normals,
        measured=normals,
        tangents=tangents(normals),
        weights=weights[start + blocks] / context.length ** (d - 1),
        tied=pair.sides.tied,
    )


def _summed_normals(pair: Pair, overlaps: Overlaps, rows: RelativeRows) -> tuple[Array, Array]:
    """Vectors along the normals of all nodes (N, d), and the nodes' weights (N,).

    On curved facets these are ∫φ_i n, and ∫ψ_i times the size of that over ∫φ_i: so a uniform pressure has the forces
    of its nodal values, whatever the curve (as of :func:`.contact_surface.make_surface`).
    """
    sums = np.zeros((len(rows.weights), pair.first.points.shape[2]))
    if not pair.first.curved:
        for node in range(pair.first.nodes.shape[1]):
            np.add.at(sums, pair.first.nodes[:, node], pair.first.areas[:, None] * pair.first.normals)
        return sums, rows.weights
    points, sizes = overlaps.points(pair.first.degree), np.zeros(len(sums))
    functions = points.weights[:, None] * pair.first.functions(points.on_first)
    normals = pair.first.normals_at(points.first, points.on_first)
    np.add.at(sums, pair.first.nodes[points.first], functions[:, :, None] * normals[:, None])
    np.add.at(sizes, pair.first.nodes[points.first], functions)
    ratio = np.divide(np.linalg.norm(sums, axis=1), sizes, out=np.ones_like(sizes), where=sizes > 0.0)
    return sums, rows.weights * ratio


def _gaps(context: DomainForms, surface: Surface, pair: Pair, rows: RelativeRows) -> Array:
    """The distance of the sides along the normals, m, (m,): the relative displacement of the positions."""
    d, own = context.dimension, context.space.dofmap.index_map.local_range[0] + surface.blocks
    places = np.zeros((len(rows.weights), d))
    for side in (pair.first, pair.second):
        places[side.nodes.ravel()] = side.positions.reshape(-1, d)
    apart = (rows.second[own] @ places - rows.first[own] @ places) / rows.weights[own, None]
    return np.sum(apart * surface.normals, axis=1)


def _dofs(context: DomainForms, surface: Surface) -> Entities:
    """The scalar dofs (owned and ghost) of a surface. Collective."""
    marks = fem.Function(context.space)
    marks.x.array[surface.dofs] = 1.0
    marks.x.scatter_forward()
    return np.flatnonzero(marks.x.array).astype(np.int32)
