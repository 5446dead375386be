"""Interfaces: where two bodies meet. The nodes of the first side carry laws of the relative displacement.

What carries nothing leaves its share to its neighbours (:mod:`.dual_basis`): nodes beyond the end of the second
side, and those that are prescribed, on another part with contact or laws, or on another interface.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from scipy.sparse import csr_array

from ..geometry import tangents
from ..mesh.boundary_part import InterfaceSides
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers
from . import curved_shapes, dual_basis, interface_checks, interface_sides
from .contact_surface import Surface
from .domain_forms import DomainForms
from .dual_basis import RelativeRows
from .facet_overlaps import Facets, Overlaps
from .interface_sides import Pair
from .thresholds import DEFAULT, CompositionThresholds


@dataclass(frozen=True, kw_only=True)
class Interface:
    """An interface on a mesh.

    Attributes:
        name: of the interface.
        tied: the scalar dofs (owned and ghost) of relative displacements that are zero for ever.
        surface: the vertices of the first side that carry something, as a part with contact or laws has them.
        gap: the distance of the two sides as they are meshed, at these vertices, m, (m,).
        rows: what the relative displacement is made of, the same on all ranks.
        first: the facets of the first side.
        second: those of the second.
        overlaps: their intersections.
        sides: what the scene says of it.
        members: local vertices of both sides.
        curved: whether facets are curved through their nodes.
    """

    name: str
    tied: Entities
    surface: Surface
    gap: Array
    rows: RelativeRows
    members: Entities
    first: Facets
    second: Facets
    overlaps: Overlaps
    sides: InterfaceSides
    curved: bool


def find(
    context: DomainForms,
    wanted: Mapping[str, InterfaceSides],
    occupied: Entities,
    thresholds: CompositionThresholds = DEFAULT,
) -> tuple[Interface, ...]:
    """The interfaces of a problem. Collective.

    Args:
        context: spaces, parts and vertices.
        wanted: what the scene says of each, by name.
        occupied: local vertices that are prescribed, or on a part with contact or laws.
        thresholds: which facets face each other.

    Raises:
        InputError: on all ranks alike: sides that do not face each other or overlap, or what is not supported.
    """
    if not wanted:
        return ()
    pairs = {name: interface_sides.pair(context, name, sides) for name, sides in wanted.items()}
    taken = context.space.dofmap.index_map.local_to_global(np.asarray(occupied, dtype=np.int32))
    taken = np.unique(np.concatenate(agree(context.domain.mesh.comm, taken)))
    return tuple(_interface(context, name, pairs, taken, thresholds) for name in wanted)


def _interface(
    context: DomainForms, name: str, pairs: Mapping[str, Pair], taken: Integers, thresholds: CompositionThresholds
) -> Interface:
    """One interface: its intersections, which nodes of its first side carry something, normals, gaps. Collective.

    Nodes that are taken, by other interfaces too, or that the second side does not cover, carry nothing.
    """
    pair = pairs[name]
    overlaps = pair.overlaps(thresholds)
    interface_checks.check_facing(pair, overlaps)
    others = [taken, np.unique(pair.second.nodes)]
    others += [np.unique([*p.first.nodes.flat, *p.second.nodes.flat]) for n, p in pairs.items() if n != name]
    busy, covered = np.isin(pair.first.nodes, np.concatenate(others)), pair.covered(overlaps)
    kept = ~np.isin(pair.first.nodes, np.unique(pair.first.nodes[~covered | busy]))
    interface_checks.check_carried(pair, overlaps, kept, covered & busy)
    size = context.space.dofmap.index_map.size_global
    rows = dual_basis.relative_rows(pair.first, pair.second, overlaps, kept, size)
    surface = _surface(context, pair, overlaps, rows)
    gap = _gaps(context, surface, pair, rows)
    interface_checks.check_apart(context.domain.mesh.comm, pair, surface, gap, thresholds)
    tied = _dofs(context, surface) if pair.sides.tied else np.empty(0, np.int32)
    return Interface(
        name=name,
        tied=tied,
        surface=surface,
        gap=gap,
        rows=rows,
        members=pair.members(context),
        first=pair.first,
        second=pair.second,
        overlaps=overlaps,
        sides=pair.sides,
        curved=pair.curved,
    )


def _own(context: DomainForms, rows: RelativeRows) -> Entities:
    """Local vertices that this rank owns and that carry something."""
    start, end = context.space.dofmap.index_map.local_range
    return np.flatnonzero(rows.weights[start:end] > 0.0).astype(np.int32)


def _surface(context: DomainForms, pair: Pair, overlaps: Overlaps, rows: RelativeRows) -> Surface:
    d, start = context.dimension, context.space.dofmap.index_map.local_range[0]
    blocks = _own(context, rows)
    sums, weights = _summed_normals(pair, overlaps, rows)
    mean = sums[start + blocks]
    normals = mean / np.linalg.norm(mean, axis=1, keepdims=True)
    normals = np.where(np.abs(normals) < DEFAULT.rounding * 10, 0.0, normals)
    normals = np.where(np.abs(normals) > 1 - DEFAULT.rounding * 10, np.round(normals), normals)
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
    if not pair.curved:
        for node in range(pair.first.nodes.shape[1]):
            np.add.at(sums, pair.first.nodes[:, node], pair.first.areas[:, None] * pair.first.normals)
        return sums, rows.weights
    points, sizes = overlaps.points(pair.first.degree), np.zeros(len(sums))
    functions = points.weights[:, None] * pair.first.functions(points.on_first)
    normals = curved_shapes.normals(pair.first, points)
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
    return np.asarray(np.sum(apart * surface.normals, axis=1))


def _dofs(context: DomainForms, surface: Surface) -> Entities:
    """The scalar dofs (owned and ghost) of a surface. Collective."""
    marks = fem.Function(context.space)
    marks.x.array[surface.dofs] = 1.0
    marks.x.scatter_forward()
    return np.flatnonzero(marks.x.array).astype(np.int32)


def whole_rows(found: Sequence[Interface], size: int) -> Iterator[tuple[csr_array, Array]]:
    """For each interface the rows w = R u, and the diagonal of R, over the vertices of the mesh.

    Args:
        found: the interfaces.
        size: number of vertices of the mesh.
    """
    for one in found:
        scale = np.divide(1.0, one.rows.weights, out=np.zeros(size), where=one.rows.weights > 0.0)
        rows = csr_array((one.rows.first - one.rows.second).multiply(scale[:, None]))
        yield rows, np.asarray(rows.diagonal())
