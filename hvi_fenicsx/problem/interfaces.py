"""Interfaces: where two bodies meet. The nodes of the first side carry laws of the relative displacement.

What carries nothing leaves its share to its neighbours (:mod:`.dual_basis`): nodes beyond the end of the second
side, and those that are prescribed, on another part with contact or laws, or on another interface.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from scipy.sparse import csr_array

from ..errors import InputError
from ..mesh import nodes
from ..mesh.refinement import cell_facets
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from . import dual_basis, facet_overlaps, spaces
from .contact_surface import Surface, tangents
from .domain_forms import DomainForms
from .dual_basis import RelativeRows
from .facet_overlaps import Facets, Overlaps
from .thresholds import DEFAULT, Thresholds


@dataclass(frozen=True, kw_only=True)
class Sides:
    """What a scene says of an interface.

    Attributes:
        first: the side that carries contact and laws.
        second: the other one.
        tied: whether the sides are glued for ever.
    """

    first: str
    second: str
    tied: bool = False


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
    sides: Sides


@dataclass(frozen=True)
class _Pair:
    """The facets of the two sides of an interface, the same on all ranks."""

    sides: Sides
    first: Facets
    second: Facets


def find(
    context: DomainForms, wanted: Mapping[str, Sides], occupied: Entities, thresholds: Thresholds = DEFAULT
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
    pairs = {name: _pair(context, name, sides) for name, sides in wanted.items()}
    taken = context.space.dofmap.index_map.local_to_global(np.asarray(occupied, dtype=np.int32))
    taken = np.unique(np.concatenate(agree(context.domain.mesh.comm, taken)))
    return tuple(_interface(context, name, pairs, taken, thresholds) for name in wanted)


def _pair(context: DomainForms, name: str, sides: Sides) -> _Pair:
    """The facets of both sides on all ranks. Collective."""
    found = []
    for side in (sides.first, sides.second):
        facets = _gathered(context, context.domain.facets([side]))
        if not len(facets.nodes):
            raise InputError(f"interface.{name}.between: no facet lies on {side!r}")
        found.append(facets)
    return _Pair(sides, *found)


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
        context.points_on_curves[blocks][:, :, :d],
        _outward(context.points[blocks[:, :d]][:, :, :d], context.points[inner][:, :d]),
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


def _outward(corners: Array, inner: Array) -> Array:
    """Unit normals of segments or triangles (f, d, d) away from points inside (f, d)."""
    sides = corners[:, 1:] - corners[:, :1]
    plane = corners.shape[1] == 2
    across = np.column_stack([sides[:, 0, 1], -sides[:, 0, 0]]) if plane else np.cross(sides[:, 0], sides[:, 1])
    normals = across / np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(normals * -np.sign(np.sum(normals * (inner - corners[:, 0]), axis=1, keepdims=True)))


def _interface(
    context: DomainForms, name: str, pairs: Mapping[str, _Pair], taken: Integers, thresholds: Thresholds
) -> Interface:
    pair = pairs[name]
    overlaps = _overlaps(pair, thresholds)
    if not len(overlaps.areas):
        raise InputError(
            f'interface.{name}.between: "{pair.sides.first}" and "{pair.sides.second}" do not face each other: nowhere '
            "does a normal of the first meet a facet of the second; name sides that lie over each other"
        )
    others = [taken, np.unique(pair.second.nodes)]
    others += [np.unique([*p.first.nodes.flat, *p.second.nodes.flat]) for n, p in pairs.items() if n != name]
    busy, covered = np.isin(pair.first.nodes, np.concatenate(others)), _covered(pair.first, overlaps)
    kept = ~np.isin(pair.first.nodes, np.unique(pair.first.nodes[~covered | busy]))
    _check_pieces(context, name, pair, overlaps, kept, covered & busy)
    size = context.space.dofmap.index_map.size_global
    rows = dual_basis.relative_rows(pair.first, pair.second, overlaps, kept, size)
    surface = _surface(context, name, pair, rows)
    gap = _gaps(context, surface, pair, rows)
    _check_gaps(context, name, pair, surface, gap, thresholds)
    tied = _dofs(context, surface) if pair.sides.tied else np.empty(0, np.int32)
    return Interface(
        name=name,
        tied=tied,
        surface=surface,
        gap=gap,
        rows=rows,
        members=_members(context, pair),
        first=pair.first,
        second=pair.second,
        overlaps=overlaps,
        sides=pair.sides,
    )


def _overlaps(pair: _Pair, thresholds: Thresholds) -> Overlaps:
    """The intersections of the facets of both sides."""
    if pair.first.points.shape[2] == 2:
        return facet_overlaps.in_plane(pair.first, pair.second, thresholds)
    from . import facet_polygons  # shapely, which plane bodies do not need

    return facet_polygons.in_space(pair.first, pair.second, thresholds)


def _covered(first: Facets, overlaps: Overlaps) -> Mask:
    """Whether each node of facets lies over the second side, a midpoint with both ends of its edge, (f, n)."""
    middles = [overlaps.covered[:, ends].all(axis=1) for ends in first.edges]
    return np.column_stack([overlaps.covered, *middles])


def _check_pieces(context: DomainForms, name: str, pair: _Pair, overlaps: Overlaps, kept: Mask, busy: Mask) -> None:
    """Refuse an interface without a vertex that carries something, or a part of it that nothing carries."""
    if not kept.any():
        raise InputError(
            f'interface.{name}.between: no vertex of "{pair.sides.first}" is free to carry contact or laws: each lies '
            f'beyond the end of "{pair.sides.second}", is prescribed, or is on another part; name the longer side '
            "second, or make the mesh of the first finer"
        )
    lost = np.setdiff1d(overlaps.first, np.flatnonzero(kept.any(axis=1) | ~busy.any(axis=1)))
    lost = np.setdiff1d(lost, list(dual_basis.adopted(pair.first, overlaps, kept)))
    if len(lost):
        at = tuple(float(f"{c:.6g}") for c in pair.first.corners[lost[0]].mean(axis=0))
        raise InputError(
            f"interface.{name}: nothing carries the facet at {at}: its vertices and those near it are prescribed or on "
            "other parts; make the mesh there finer"
        )


def _own(context: DomainForms, rows: RelativeRows) -> Entities:
    """Local vertices that this rank owns and that carry something."""
    start, end = context.space.dofmap.index_map.local_range
    return np.flatnonzero(rows.weights[start:end] > 0.0).astype(np.int32)


def _surface(context: DomainForms, name: str, pair: _Pair, rows: RelativeRows) -> Surface:
    d, start = context.dimension, context.space.dofmap.index_map.local_range[0]
    blocks = _own(context, rows)
    sums = np.zeros((len(rows.weights), d))
    for node in range(pair.first.nodes.shape[1]):
        np.add.at(sums, pair.first.nodes[:, node], pair.first.areas[:, None] * pair.first.normals)
    mean = sums[start + blocks]
    normals = mean / np.linalg.norm(mean, axis=1, keepdims=True)
    normals = np.where(np.abs(normals) < DEFAULT.rounding * 10, 0.0, normals)
    normals = np.where(np.abs(normals) > 1 - DEFAULT.rounding * 10, np.round(normals), normals)
    return Surface(
        part=name,
        facets=context.part_facets[name],
        blocks=blocks,
        points=context.points[blocks],
        normals=normals,
        measured=normals,
        tangents=tangents(normals),
        weights=rows.weights[start + blocks] / context.length ** (d - 1),
        tied=pair.sides.tied,
    )


def _gaps(context: DomainForms, surface: Surface, pair: _Pair, rows: RelativeRows) -> Array:
    """The distance of the sides along the normals, m, (m,): the relative displacement of the positions."""
    d, own = context.dimension, context.space.dofmap.index_map.local_range[0] + surface.blocks
    places = np.zeros((len(rows.weights), d))
    for side in (pair.first, pair.second):
        places[side.nodes.ravel()] = side.positions.reshape(-1, d)
    apart = (rows.second[own] @ places - rows.first[own] @ places) / rows.weights[own, None]
    return np.asarray(np.sum(apart * surface.normals, axis=1))


def _check_gaps(
    context: DomainForms, name: str, pair: _Pair, surface: Surface, gap: Array, thresholds: Thresholds
) -> None:
    """Refuse bodies that overlap by more than the facets of their curved sides do."""
    deepest = [(float(gap[i]), tuple(map(float, surface.points[i][: context.dimension]))) for i in _lowest(gap)]
    depth, at = min((pair for rank in agree(context.domain.mesh.comm, deepest) for pair in rank), default=(0.0, ()))
    if depth < -thresholds.overlap * pair.first.width:
        place = ", ".join(f"{c:.6g}" for c in at)
        raise InputError(
            f'interface.{name}.between: at ({place}) "{pair.sides.second}" lies {-depth:.3g} m inside of the body of '
            f'"{pair.sides.first}": move one of the bodies, or name the sides that face each other'
        )


def _lowest(gap: Array) -> Iterable[int]:
    return (int(np.argmin(gap)),) if len(gap) else ()


def _dofs(context: DomainForms, surface: Surface) -> Entities:
    """The scalar dofs (owned and ghost) of a surface. Collective."""
    marks = fem.Function(context.space)
    marks.x.array[surface.dofs] = 1.0
    marks.x.scatter_forward()
    return np.flatnonzero(marks.x.array).astype(np.int32)


def _members(context: DomainForms, pair: _Pair) -> Entities:
    """Local vertices (owned) of both sides."""
    start, end = context.space.dofmap.index_map.local_range
    both = np.unique(np.concatenate([pair.first.nodes.ravel(), pair.second.nodes.ravel()]))
    return np.asarray(both[(both >= start) & (both < end)] - start, dtype=np.int32)


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
