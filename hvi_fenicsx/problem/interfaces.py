"""Interfaces: where two bodies meet. The nodes of the first side carry laws of the relative displacement.

What carries nothing leaves its share to its neighbours (:mod:`.dual_basis`): nodes beyond the end of the second
side, and those that are prescribed, on another part with contact or laws, or on another interface.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc
from scipy.sparse import csr_array, diags_array, eye_array, kron

from ..errors import InputError
from ..geometry import tangents
from ..mesh.boundary_part import InterfaceSides
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers, Mask
from . import curved_overlaps, dual_basis, interface_sides
from .contact_surface import Surface
from .domain_forms import DomainForms
from .dual_basis import RelativeRows
from .facet_overlaps import Facets, Overlaps
from .interface_sides import Pair
from .scaling import DEFAULT


def check_facing(pair: Pair, overlaps: Overlaps) -> None:
    """Refuse two sides that do not lie over each other anywhere.

    Args:
        pair: the sides.
        overlaps: the intersections of their facets.

    Raises:
        InputError: there are none.
    """
    if not len(overlaps.areas):
        raise InputError(
            f'interface.{pair.name}.between: "{pair.sides.first}" and "{pair.sides.second}" do not face each other: '
            "nowhere does a normal of the first meet a facet of the second; name sides that lie over each other"
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
    deepest = [(float(gap[i]), surface.spot(i)) for i in _lowest(gap)]
    depth, at = min((place for rank in agree(comm, deepest) for place in rank), default=(0.0, ""))
    if depth < -DEFAULT.overlap * pair.first.width:
        raise InputError(
            f'interface.{pair.name}.between: at {at} "{pair.sides.second}" lies {-depth:.3g} m inside of the body '
            f'of "{pair.sides.first}": move one of the bodies, name the sides that face each other, or mesh '
            "curved sides more finely"
        )


def _lowest(gap: Array) -> Iterable[int]:
    return (int(np.argmin(gap)),) if len(gap) else ()


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
    pairs = {name: interface_sides.pair(context, name, sides) for name, sides in wanted.items()}
    taken = context.space.dofmap.index_map.local_to_global(np.asarray(occupied, dtype=np.int32))
    taken = np.unique(np.concatenate(agree(context.domain.mesh.comm, taken)))
    return tuple(_interface(context, name, pairs, taken) for name in wanted)


def _interface(context: DomainForms, name: str, pairs: Mapping[str, Pair], taken: Integers) -> Interface:
    """One interface: its intersections, which nodes of its first side carry something, normals, gaps. Collective.

    Nodes that are taken, by other interfaces too, or that the second side does not cover, carry nothing.
    """
    pair = pairs[name]
    overlaps = pair.overlaps()
    check_facing(pair, overlaps)
    others = [taken, np.unique(pair.second.nodes)]
    others += [np.unique([*p.first.nodes.flat, *p.second.nodes.flat]) for n, p in pairs.items() if n != name]
    busy, covered = np.isin(pair.first.nodes, np.concatenate(others)), pair.covered(overlaps)
    kept = ~np.isin(pair.first.nodes, np.unique(pair.first.nodes[~covered | busy]))
    check_carried(pair, overlaps, kept, covered & busy)
    size = context.space.dofmap.index_map.size_global
    rows = dual_basis.relative_rows(pair.first, pair.second, overlaps, kept, size)
    surface = _surface(context, pair, overlaps, rows)
    gap = _gaps(context, surface, pair, rows)
    check_apart(context.domain.mesh.comm, pair, surface, gap)
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
    normals = curved_overlaps.normals(pair.first, points)
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


@dataclass(frozen=True)
class Coupling:
    """The way between displacements u and unknowns û, both in Cartesian components.

    Attributes:
        space: of the displacements.
        matrix: T.
        inverse: T⁻¹.
    """

    space: fem.FunctionSpace
    matrix: PETSc.Mat
    inverse: PETSc.Mat

    def relative(self, u: Array) -> Array:
        """T⁻¹ u of a local array, of which the owned values count; a local array. Collective."""
        return self._local(self.inverse.mult, u)

    def forces(self, values: Array) -> Array:
        """Tᵀ f: forces on u, at the owned vertices (n, d), as forces on û. Collective."""
        return self._local(self.matrix.multTranspose, values)[: values.size].reshape(values.shape)

    def forces_on_bodies(self, values: Array) -> Array:
        """T⁻ᵀ f: forces on û, at the owned vertices (n, d), as forces on the vertices of the bodies. Collective."""
        return self._local(self.inverse.multTranspose, values)[: values.size].reshape(values.shape)

    def _local(self, product: object, values: Array) -> Array:
        """A product with a local array, as a local array with ghosts updated."""
        function = fem.Function(self.space)
        right, left = self.matrix.createVecs()
        right.array[:] = values.ravel()[: right.local_size]
        product(right, left)  # type: ignore[operator]
        function.x.array[: left.local_size] = left.array_r
        function.x.scatter_forward()
        right.destroy()
        left.destroy()
        return np.array(function.x.array)


def coupled(space: fem.FunctionSpace, interfaces: Sequence[Interface]) -> Coupling | None:
    """The coupling of interfaces; None where there are none. Collective.

    Args:
        space: of the displacements.
        interfaces: none of whose nodes with weights is combined by another.
    """
    if not interfaces:
        return None
    size, (start, end) = space.dofmap.index_map.size_global, space.dofmap.index_map.local_range
    inverse, forward = (csr_array(eye_array(size, format="csr")[start:end]) for _ in range(2))
    for rows, diagonal in whole_rows(interfaces, size):
        own = diags_array(diagonal[start:end], offsets=0) @ eye_array(size, format="csr")[start:end]
        rest, scale = rows[start:end] - own, diagonal[start:end]
        unit = diags_array((scale != 0.0).astype(float), offsets=0) @ eye_array(size, format="csr")[start:end]
        over = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale != 0.0)
        inverse = inverse + rest + own - unit
        forward = forward - diags_array(over, offsets=0) @ (rest - unit) - unit
    return Coupling(space, _petsc_matrix(space, forward), _petsc_matrix(space, inverse))


def _petsc_matrix(space: fem.FunctionSpace, rows: csr_array) -> PETSc.Mat:
    """A matrix over vertices as one over their vectors, component by component. Collective."""
    d, index_map = space.dofmap.index_map_bs, space.dofmap.index_map
    whole = csr_array(kron(csr_array(rows), np.eye(d), format="csr"))
    whole.eliminate_zeros()
    whole.sort_indices()
    size = index_map.size_local * d, index_map.size_global * d
    arrays = whole.indptr.astype(PETSc.IntType), whole.indices.astype(PETSc.IntType), whole.data
    matrix = PETSc.Mat().createAIJ((size, size), bsize=d, csr=arrays, comm=space.mesh.comm)
    matrix.assemble()
    return matrix
