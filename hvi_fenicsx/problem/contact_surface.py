"""Γc at its vertices: where each contact part's nodes are, their normals, tangents and lumped areas.

Vertex (trapezoidal) quadrature makes every boundary term a sum over these nodes (paper, section 4.2).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI
from scipy.spatial import KDTree

from ..errors import InputError
from ..geometry import spot, tangents, units
from ..runtime.mpi import agree, largest, refuse
from ..typing import Array, Entities, Integers
from .facets import Facets, is_curved, quadric_of, turned
from .scaling import DEFAULT
from .spaces import coefficients_of
from .vectors import nodal


@dataclass(frozen=True, slots=True, kw_only=True)
class Surface:
    """The vertices of one boundary part that this rank owns (m of them).

    Attributes:
        part: its name.
        facets: its local facets.
        blocks: local indices of its vertices (blocks of the space), (m,).
        points: the vertices, m, (m, 3).
        normals: outward unit normals, (m, d).
        measured: the unit normals along which the scene states the gap; they differ from `normals` only where the part
            shares a vertex with a prescribed component or with another part, (m, d).
        tangents: unit tangents (:func:`tangents`), (m, d-1, d).
        weights: lumped area of each vertex over L^(d-1), (m,).
        tied: whether the displacement is held at zero: that of two bodies that are glued, relative to each other.
    """

    part: str
    facets: Entities
    blocks: Entities
    points: Array
    normals: Array
    measured: Array
    tangents: Array
    weights: Array
    tied: bool = False

    @property
    def dofs(self) -> Integers:
        """The scalar dofs of these vertices, shape (m, d)."""
        d = self.normals.shape[1]
        return self.blocks[:, None].astype(np.int64) * d + np.arange(d)

    def values(self, u: Array) -> Array:
        """The vectors at these vertices of a local array of a P1 vector field; shape (m, d)."""
        return u.reshape(-1, self.normals.shape[1])[self.blocks]

    def spot(self, i: int) -> str:
        """Where its vertex i is, for messages."""
        return spot(self.points[i, : self.normals.shape[1]])


def make_surface(
    part: str,
    space: fem.FunctionSpace,
    vertices: Array,
    facets: Entities,
    side: Facets,
    measure: Any,
    area: float,
) -> Surface:
    """The vertices of a part, with its own normals where it is round, else the mean ones of the facets. Collective.

    Args:
        part: its name.
        space: P1 vectors.
        vertices: the local vertices of the mesh, m, (n, 3).
        facets: the part's local facets.
        side: those of all ranks.
        measure: ds with vertex quadrature over the part, SI.
        area: L^(d-1), what the weights are divided by.

    Raises:
        InputError: on all ranks alike: a vertex is on none but facets inside the body, which have no outward normal.
    """
    blocks, test = own_nodes(space, facets), ufl.TestFunction(space)
    normal = nodal(ufl.inner(ufl.FacetNormal(space.mesh), test) * measure)[blocks]
    ones = ufl.as_vector([fem.Constant(space.mesh, 1.0)] * normal.shape[1])
    weights: Array = nodal(ufl.inner(ones, test) * measure)[blocks, 0] / area
    if any(agree(space.mesh.comm, bool(np.any(weights == 0.0)))):
        raise InputError(f"boundary.{part}: contact and laws act on the body's surface, and facets of it lie inside")
    lies_on, places = quadric_of(side), coefficients_of(space, vertices)[blocks, : normal.shape[1]]
    normals = turned(normal if lies_on is None else lies_on.slopes(places), normal)
    if is_curved(space):  # so a uniform pressure presses along them as its nodal values do, whatever the curve
        weights = np.sum(normal * normals, axis=1) / area
    return Surface(
        part=part,
        facets=facets,
        blocks=blocks,
        points=vertices[blocks],
        normals=normals,
        measured=normals,
        tangents=tangents(normals),
        weights=weights,
    )


def own_nodes(space: fem.FunctionSpace, facets: Entities) -> Entities:
    """The nodes of facets that this rank owns, ascending. Collective.

    Args:
        space: of the displacements.
        facets: local facets.
    """
    dofs = fem.locate_dofs_topological(space, space.mesh.geometry.dim - 1, facets)
    return np.unique(dofs[dofs < space.dofmap.index_map.size_local])


def component_dofs(blocks: Entities, directions: Array) -> tuple[Integers, Array]:
    """The scalar dofs (m,) of directions along an axis of their vertex's frame, and the directions' signs (m,).

    Args:
        blocks: local indices of the vertices, (m,).
        directions: unit vectors, each along an axis, (m, d).
    """
    axis = np.argmax(np.abs(directions), axis=1)
    return blocks.astype(np.int64) * directions.shape[1] + axis, np.sign(directions[np.arange(len(axis)), axis])


class _Row(NamedTuple):
    """A direction that a vertex has already: what brought it, its unit vector (d,), is it a prescribed component?"""

    name: str
    direction: Array
    prescribed: bool


def decide(
    comm: MPI.Comm, surfaces: Mapping[str, Surface], stated: Mapping[str, Array], fixed: Entities, length: float
) -> dict[str, Surface]:
    """The surfaces with the normals that count. Collective.

    Args:
        comm: the ranks of the mesh.
        surfaces: by part, with the normals of the facets.
        stated: the unit normals that the scene states (those towards an obstacle), by part, (m, d) each.
        fixed: local scalar dofs that are prescribed.
        length: of the body, m.

    Raises:
        InputError: on all ranks alike: two directions at a vertex are neither orthogonal nor equal.
    """
    own = {name: _own(s, stated.get(name), length) for name, s in surfaces.items()}
    flat = {name for name, surface in own.items() if largest_turn(comm, surface) <= DEFAULT.same}
    normals = _at_shared_vertices(comm, own, flat, fixed)
    return {name: replace(s, normals=normals[name], tangents=tangents(normals[name])) for name, s in own.items()}


def largest_turn(comm: MPI.Comm, surface: Surface) -> float:
    """The largest angle (as a chord) between the part's own normal at a vertex and the mean one. Collective.

    Args:
        comm: the ranks of the mesh.
        surface: the part.
    """
    mean = comm.allreduce(surface.weights @ surface.measured)
    away = surface.measured - mean / (np.linalg.norm(mean) or 1.0)
    return largest(comm, float(np.max(np.linalg.norm(away, axis=1), initial=0.0)))


def _own(surface: Surface, stated: Array | None, length: float) -> Surface:
    """The surface with its normals as if it were alone, without rounding."""
    if stated is None:
        # size of the coordinates over that of the facets: so much larger is rounding of normals
        facet = length * surface.weights ** (1 / (surface.normals.shape[1] - 1))
        refinement = (length + np.linalg.norm(surface.points, axis=1)) / facet
        normals = without_rounding(surface.normals, DEFAULT.rounding * refinement[:, None])
    else:
        normals = without_rounding(stated, DEFAULT.rounding)
    return replace(surface, normals=normals, measured=normals)


def without_rounding(normals: Array, rounding: Array | float) -> Array:
    """Unit vectors along others, with zero for components that are no larger than rounding.

    Args:
        normals: of any length near 1, (m, d).
        rounding: a number, or (m, 1).
    """
    return units(np.where(np.abs(normals) <= rounding, 0.0, normals))


def _at_shared_vertices(
    comm: MPI.Comm, surfaces: Mapping[str, Surface], flat: Collection[str], fixed: Entities
) -> dict[str, Array]:
    """The normals (m, d) by part, orthogonal or equal to what else a vertex has. Collective."""
    normals = {name: surface.normals.copy() for name, surface in surfaces.items()}
    if not normals:
        return normals
    axes, prescribed = np.eye(next(iter(normals.values())).shape[1]), set(map(int, fixed))
    bad: list[str] = []
    for block in _candidates(surfaces, fixed // len(axes)):
        places = [(name, int(i)) for name, s in surfaces.items() for i in np.flatnonzero(s.blocks == block)]
        held = [i for i in range(len(axes)) if int(block) * len(axes) + i in prescribed]
        if len(held) == len(axes):  # no use for a normal
            continue
        rows = [_Row(f"u_{'xyz'[i]}", axes[i], True) for i in held]
        for name, i in sorted(places, key=lambda place: place[0] not in flat):
            found = _turned(normals[name][i], rows, flat=name in flat)
            if isinstance(found, str):
                bad.append(f"boundary.{name}: at the vertex {surfaces[name].spot(i)} {found}")
                break
            normals[name][i] = found
            rows.append(_Row(f"boundary.{name}", found, False))
    refuse(comm, bad)
    return normals


def _candidates(surfaces: Mapping[str, Surface], fixed: Entities) -> Entities:
    """The blocks with a slanted normal that lie on several parts, or on one and are among those that are fixed."""
    slanted = [s.blocks[np.count_nonzero(s.normals, axis=1) > 1] for s in surfaces.values()]
    blocks, counts = np.unique(np.concatenate([s.blocks for s in surfaces.values()]), return_counts=True)
    return np.intersect1d(np.concatenate(slanted), np.union1d(blocks[counts > 1], fixed))


def _turned(normal: Array, rows: Sequence[_Row], *, flat: bool) -> Array | str:
    """The normal of a part, flat or not, orthogonal or equal to each row; or why not."""
    rest = normal
    for row in rows:
        exact = DEFAULT.turned_to_prescribed if row.prescribed else DEFAULT.same
        limit, along = exact if flat else DEFAULT.uneven, float(row.direction @ normal)
        if math.hypot(*(normal - along * row.direction)) <= limit:
            return math.copysign(1.0, along) * row.direction
        if abs(along) > limit:
            angle = math.degrees(math.acos(min(abs(along), 1.0)))
            return (
                f"its normal makes an angle of {angle:.6g}° with the direction of {row.name}; they must be orthogonal "
                f"or equal, here to within {math.degrees(limit):.2g}°. Move the edge of the part, prescribe all "
                "components there, leave it out of the part (`where`), or state the normal: contact = { obstacle = "
                "{ point = ..., normal = ... } }, of a round obstacle its `direction`"
            )
        rest = rest - (row.direction @ rest) * row.direction
    return rest / np.linalg.norm(rest)


def refuse_facing_sides(comm: MPI.Comm, surfaces: Iterable[Surface], length: float) -> None:
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
    pairs = KDTree(points).query_pairs(near, output_type="ndarray")
    facing = pairs[np.einsum("pi,pi->p", normals[pairs[:, 0]], normals[pairs[:, 1]]) < -0.5]
    return points[np.sort(facing.ravel())[0]] if len(facing) else None
