"""Interfaces: where two bodies meet. The nodes of the first side carry laws of the relative displacement.

What carries nothing leaves its share to its neighbours (:mod:`.dual_basis`): nodes beyond the end of the second
side, and those that are prescribed, on another part with contact or laws, or on another interface.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from dolfinx import fem

from ..errors import InputError
from ..geometry import spot, tangents
from ..mesh import curved as curved_cells
from ..mesh.boundary_part import InterfaceSides
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from . import dual_basis, facet_overlaps, spaces
from .contact_surface import Surface, without_rounding
from .domain_forms import DomainForms
from .dual_basis import RelativeRows
from .facet_overlaps import Overlaps
from .facets import Facets, is_curved, quadric_of, turned
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
        facets = context.gathered(context.domain.facets([side]))
        if not len(facets.nodes):
            raise InputError(f"interface.{name}.between: no facet lies on {side!r}")
        found.append(facets)
    curved = is_curved(context.space) and any(curved_cells.is_curved(facets.points) for facets in found)
    return Pair(name, sides, *(replace(facets, curved=curved) for facets in found))


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
        at = spot(pair.first.corners[lost[0]].mean(axis=0))
        raise InputError(
            f"interface.{pair.name}: nothing carries the facet at {at}: its vertices and those near it are prescribed "
            "or on other parts; make the mesh there finer"
        )


def check_apart(pair: Pair, points: Array, gaps: Array) -> None:
    """Refuse bodies that overlap by more than the facets of their curved sides do.

    Args:
        pair: the sides.
        points: the nodes of the first side that carry something, m, (m, d).
        gaps: the distance of the sides there, m, (m,).

    Raises:
        InputError: with the place where they overlap most.
    """
    depth, at = -gaps.min(), spot(points[np.argmin(gaps)])
    if depth > DEFAULT.overlap * pair.first.width:
        raise InputError(
            f'interface.{pair.name}.between: at {at} "{pair.sides.second}" lies {depth:.3g} m inside of the body '
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


def find(
    context: DomainForms, wanted: Mapping[str, InterfaceSides], occupied: Entities, fixed: Entities
) -> tuple[Interface, ...]:
    """The interfaces of a problem. Collective.

    Args:
        context: spaces, parts and vertices.
        wanted: what the scene says of each, by name.
        occupied: local vertices that are prescribed, or on a part with contact or laws.
        fixed: local scalar dofs that are prescribed.

    Raises:
        InputError: on all ranks alike: sides that do not face each other or overlap, or what is not supported.
    """
    if not wanted:
        return ()
    pairs = {name: _pair(context, name, sides) for name, sides in wanted.items()}
    nodes_of, times = np.unique(fixed // context.dimension, return_counts=True)
    known = [spaces.global_numbers(context.space, some) for some in (occupied, nodes_of[times == context.dimension])]
    taken, held = map(np.concatenate, zip(*agree(context.mesh.comm, known), strict=True))
    return tuple(_interface(context, name, pairs, taken, held) for name in wanted)


def _interface(
    context: DomainForms, name: str, pairs: Mapping[str, Pair], taken: Integers, held: Integers
) -> Interface:
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
    kept = np.isin(pair.first.nodes, pair.first.nodes[covered]) & ~busy
    check_carried(pair, overlaps, kept, covered & busy)
    size = context.space.dofmap.index_map.size_global
    rows = dual_basis.relative_rows(pair.first, pair.second, overlaps, kept, size)
    places = np.zeros((size, context.dimension))
    for side in (pair.first, pair.second):
        places[side.nodes.ravel()] = side.positions.reshape(-1, context.dimension)
    normals, weights, gaps, meets = _directions(pair, overlaps, rows, places, held)
    start, end = context.space.dofmap.index_map.local_range
    own = np.flatnonzero(rows.weights)
    here = (own >= start) & (own < end)
    surface = _surface(context, pair, (own[here] - start).astype(np.int32), normals[here], weights[here])
    both = np.union1d(pair.first.nodes, pair.second.nodes)
    return Interface(
        **vars(pair),
        tied=_dofs(context, surface) if pair.sides.tied else np.empty(0, np.int32),
        surface=surface,
        gap=gaps[here],
        rows=dual_basis.rigid_rows(rows, places, meets),
        overlaps=overlaps,
        members=(both[(both >= start) & (both < end)] - start).astype(np.int32),
    )


def _surface(context: DomainForms, pair: Pair, blocks: Entities, normals: Array, weights: Array) -> Surface:
    """The nodes of this rank that carry something."""
    return Surface(
        part=pair.name,
        facets=context.part_facets[pair.name],
        blocks=blocks,
        points=context.points[blocks],
        normals=normals,
        measured=normals,
        tangents=tangents(normals),
        weights=weights / context.length ** (context.dimension - 1),
        tied=pair.sides.tied,
    )


def _directions(
    pair: Pair, overlaps: Overlaps, rows: RelativeRows, places: Array, held: Integers
) -> tuple[Array, Array, Array, Array]:
    """Normals, weights, distances of the sides along normals, and where the second is met, of nodes with a row.

    A normal of a round side is that of where the nodes that a row consists of are on average, but for those held.
    """
    own, surfaces = np.flatnonzero(rows.weights), (quadric_of(pair.first), quadric_of(pair.second))
    sums, sizes = (found[own] for found in _summed_normals(pair, overlaps, len(places)))
    moving = np.isin(np.arange(len(places)), held, invert=True)[:, None]
    middles = (rows.first[own] @ (moving * places)) / (rows.first[own] @ moving)
    normals = turned(sums if surfaces[0] is None else surfaces[0].slopes(middles), sums)
    normals = without_rounding(normals, DEFAULT.rounding * 10)
    at, met = (matrix[own] @ places for matrix in (rows.first, rows.second))
    far = pair.first.share != 0.0  # coefficients are no places
    low, high = (
        np.sum((end - at) * normals, axis=1) if one is None or far else one.distances(at, normals)
        for one, end in zip(surfaces, (at, met), strict=True)
    )
    gaps = high - low
    check_apart(pair, at, gaps)
    weights = rows.weights[own] * np.sum(sums * normals, axis=1) / sizes
    return normals, weights, gaps, at + gaps[:, None] * normals


def _summed_normals(pair: Pair, overlaps: Overlaps, size: int) -> tuple[Array, Array]:
    """Vectors along the normals of all nodes, on curved facets ∫φ_i n (N, d); and ∫φ_i there (N,).

    A pressure along ∫φ_i n has weights ∫ψ_i times its size over ∫φ_i: so a uniform one has the forces of its nodal
    values, whatever the curve (as of :func:`.contact_surface.make_surface`).
    """
    side, sums, sizes = pair.first, np.zeros((size, pair.first.dimension)), np.zeros(size)
    if not side.curved:
        np.add.at(sums, side.nodes, (side.areas[:, None] * side.normals)[:, None])
        return sums, np.linalg.norm(sums, axis=1)
    points = overlaps.points(side.degree)
    functions, nodes_of = points.weights[:, None] * side.functions(points.on_first), side.nodes[points.first]
    np.add.at(sums, nodes_of, functions[:, :, None] * side.normals_at(points.first, points.on_first)[:, None])
    np.add.at(sizes, nodes_of, functions)
    return sums, sizes


def _dofs(context: DomainForms, surface: Surface) -> Entities:
    """The scalar dofs (owned and ghost) of a surface. Collective."""
    marks = fem.Function(context.space)
    marks.x.array[surface.dofs] = 1.0
    marks.x.scatter_forward()
    return np.flatnonzero(marks.x.array).astype(np.int32)
