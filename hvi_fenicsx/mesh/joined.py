"""Several bodies as one mesh of several connected parts: each with its own shape, mesh and place.

A body's mesh keeps its own coordinates and its own coarser meshes. The common mesh has copies of them in their places;
its coarser meshes are the common ones of the bodies' coarser meshes, and so is the transfer between them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from dolfinx import fem
from dolfinx import mesh as dmesh
from mpi4py import MPI
from petsc4py import PETSc
from scipy.spatial import cKDTree

from .. import compat
from ..errors import InputError
from ..geometry import ROUNDING, Curve, spot
from ..runtime.mpi import agree
from ..typing import Array, Entities, Integers
from . import facets as cell_facets
from . import nodes
from .domain import Coarsening, Domain, box
from .transfer import Rows, Transfer, barycentric_weights, renumbered


@dataclass(frozen=True, kw_only=True)
class PlacedBody:
    """A body and where it is.

    Attributes:
        name: of the body; empty for a piece of a mesh, whose sides and regions keep their names.
        domain: the body on its mesh, in its own coordinates.
        origin: where the origin of these coordinates is, m, (d,).
        rotation: how they are turned about it, (d, d).
    """

    name: str
    domain: Domain
    origin: Array
    rotation: Array

    @property
    def points(self) -> Array:
        """Its local vertices, those of the geometry, in their place, m, (n, d)."""
        return self.domain.mesh.geometry.x[:, : self.domain.dimension] @ self.rotation.T + self.origin

    @property
    def owned(self) -> int:
        """Vertices of the geometry that this rank owns."""
        return int(self.domain.mesh.geometry.index_map().size_local)

    @property
    def cells(self) -> Entities:
        """This rank's cells by the local vertices, (c, d+1)."""
        topology = self.domain.mesh.topology
        return compat.geometry_dofmap(self.domain.mesh)[: topology.index_map(topology.dim).size_local]

    def called(self, name: str) -> str:
        """What a side or a region of the body is called among those of all bodies.

        Args:
            name: within the body.
        """
        return f"{self.name}.{name}" if self.name else name

    def curves(self) -> dict[str, Curve]:
        """The curves of its sides in their place."""
        known = self.domain.curves.items()
        return {self.called(side): curve.moved(self.origin, self.rotation) for side, curve in known}


def joined(comm: MPI.Comm, bodies: Sequence[PlacedBody]) -> Domain:
    """The bodies on one mesh. Collective.

    Sides are called BODY.SIDE, regions BODY and BODY.REGION. What pieces of a mesh call alike is one.

    Args:
        comm: the ranks that share each of the meshes.
        bodies: at least one, all of one dimension.
    """
    numbers = [_numbers(comm, bodies, i) for i in range(len(bodies))]
    mesh, cells = common_mesh(comm, bodies, numbers)
    pairs = list(zip(bodies, cells, strict=True))
    sides = _united(found for body, at in pairs for found in _sides(mesh, body, at))
    regions = _united(found for body, at in pairs for found in _regions(body, at))
    curves = {name: curve for body in bodies for name, curve in body.curves().items()}
    return replace(Domain.from_mesh(mesh, sides, regions, curves), coarsening=coarsening(mesh, bodies, numbers))


def coarsening(mesh: dmesh.Mesh, bodies: Sequence[PlacedBody], numbers: Sequence[Integers]) -> Coarsening | None:
    """What makes the common mesh of the bodies' coarser meshes; None where no body has any.

    Args:
        mesh: the common mesh.
        bodies: in their places.
        numbers: of each body's local vertices among the input's of the common mesh.
    """
    if all(body.domain.coarsening is None for body in bodies):
        return None
    return lambda: _coarser(mesh, bodies, numbers)


def _united(found: Iterable[tuple[str, Entities]]) -> dict[str, Entities]:
    """The sides or regions of all bodies by name, those of one name together."""
    parts: dict[str, list[Entities]] = {}
    for name, entities in found:
        parts.setdefault(name, []).append(entities)
    return {name: np.unique(np.concatenate(those)).astype(np.int32) for name, those in parts.items()}


def _numbers(comm: MPI.Comm, bodies: Sequence[PlacedBody], number: int) -> Integers:
    """The number that the common mesh gives to each local vertex of a body. Collective.

    It counts the vertices through the ranks, on each of them body by body.
    """
    counts = np.array(agree(comm, [body.owned for body in bodies]), dtype=np.int64)
    before = np.concatenate([[0], np.cumsum(counts.sum(axis=1))])[:-1] + counts[:, :number].sum(axis=1)
    starts = np.concatenate([[0], np.cumsum(counts[:, number])])
    own = bodies[number].domain.mesh.geometry.index_map()
    every = own.local_to_global(np.arange(own.size_local + own.num_ghosts, dtype=np.int32))
    rank = np.searchsorted(starts, every, side="right") - 1
    return before[rank] + every - starts[rank]


def _sides(mesh: dmesh.Mesh, body: PlacedBody, cells: Entities) -> Iterator[tuple[str, Entities]]:
    """The local facets of a body's sides in the common mesh, where its local cells have these numbers."""
    own = np.arange(len(cells), dtype=np.int32)
    for name, facets in body.domain.sides.items():
        yield body.called(name), cell_facets.in_copies(facets, body.domain.mesh, own, mesh, cells)


def _regions(body: PlacedBody, cells: Entities) -> Iterator[tuple[str, Entities]]:
    """The local cells of a body that has a name, and of its regions, in the common mesh."""
    if body.name:
        yield body.name, cells
    for name, found in body.domain.regions.items():
        yield body.called(name), cells[found[found < len(cells)]]


def _coarser(
    mesh: dmesh.Mesh, bodies: Sequence[PlacedBody], numbers: Sequence[Integers]
) -> tuple[Domain, JoinedTransfer]:
    """The common mesh of the coarser meshes, a body without one as it is. Collective."""
    steps = [body.domain.coarser() or (body.domain, None) for body in bodies]
    coarse = [replace(body, domain=step[0]) for body, step in zip(bodies, steps, strict=True)]
    below = joined(mesh.comm, coarse)
    others = [_numbers(mesh.comm, coarse, i) for i in range(len(coarse))]
    pairs = zip(bodies, coarse, numbers, others, steps, strict=True)
    transfers = [
        PlacedTransfer(fine=b.domain.mesh, coarse=c.domain.mesh, numbers=(n, m), transfer=step[1])
        for b, c, n, m, step in pairs
    ]
    return below, JoinedTransfer(tuple(transfers))


@dataclass(frozen=True, kw_only=True)
class PlacedTransfer:
    """The transfer between the meshes of one body.

    Attributes:
        fine: its finer mesh, in its own coordinates.
        coarse: its coarser mesh, likewise.
        numbers: the numbers of their local vertices in the finer and in the coarser common mesh.
        transfer: from the coarser to the finer; None where both are the same.
    """

    fine: dmesh.Mesh
    coarse: dmesh.Mesh
    numbers: tuple[Integers, Integers]
    transfer: Transfer | None

    def prolongation(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> PETSc.Mat:
        """The prolongation of this body in the unknowns of the common meshes. Collective.

        Args:
            fine: P1 vectors on the finer common mesh.
            coarse: P1 vectors on the coarser common mesh.
        """
        own, other = (_vectors(mesh) for mesh in (self.fine, self.coarse))
        to_coarse = _selection(other, coarse, self.numbers[1])
        step = to_coarse if self.transfer is None else self.transfer.prolongation(own, other).matMult(to_coarse)
        return _selection(own, fine, self.numbers[0]).transposeMatMult(step)


@dataclass(frozen=True)
class JoinedTransfer(Transfer):
    """Between common meshes of the same bodies.

    Attributes:
        bodies: the transfer of each body.
    """

    bodies: tuple[PlacedTransfer, ...]

    def rows(self, fine: fem.FunctionSpace, coarse: fem.FunctionSpace) -> Rows:
        """Each fine vertex has the weights that its body's transfer gives it. Collective."""
        whole = self.bodies[0].prolongation(fine, coarse)
        for body in self.bodies[1:]:
            whole.axpy(1.0, body.prolongation(fine, coarse))
        start, columns, values = whole.getValuesCSR()
        return start, columns, values


def _vectors(mesh: dmesh.Mesh) -> fem.FunctionSpace:
    """P1 vectors on a mesh."""
    return fem.functionspace(mesh, ("Lagrange", 1, (mesh.geometry.dim,)))


def _selection(space: fem.FunctionSpace, common: fem.FunctionSpace, numbers: Integers) -> PETSc.Mat:
    """The matrix that takes the unknowns of a common mesh to those of one body. Collective.

    Args:
        space: P1 vectors on the body's mesh.
        common: P1 vectors on the common mesh.
        numbers: of the body's local vertices in the common mesh.
    """
    d, here = common.dofmap.index_map_bs, space.dofmap.index_map.size_local
    wanted = _by_dof(space, numbers)[:here]
    known = _by_dof(common, common.mesh.geometry.input_global_indices)
    blocks = renumbered(common, known[: common.dofmap.index_map.size_local], wanted)
    columns = (blocks[:, None] * d + np.arange(d)).ravel().astype(PETSc.IntType)
    sizes = [(m.size_local * d, m.size_global * d) for m in (space.dofmap.index_map, common.dofmap.index_map)]
    rows = np.arange(here * d + 1, dtype=PETSc.IntType)
    matrix = PETSc.Mat().createAIJ(sizes, csr=(rows, columns, np.ones(here * d)), comm=common.mesh.comm)
    matrix.assemble()
    return matrix


def _by_dof(space: fem.FunctionSpace, by_node: Integers) -> Integers:
    """Values at the geometry's vertices as values at the (block) dofs of a P1 space."""
    found = np.empty(len(by_node), dtype=np.int64)
    found[nodes.dof_of_node(space)] = by_node
    return found


def common_mesh(
    comm: MPI.Comm, parts: Sequence[PlacedBody], numbers: Sequence[Integers]
) -> tuple[dmesh.Mesh, list[Entities]]:
    """The common mesh, and the local number in it of each part's local cells. Collective.

    Args:
        comm: the ranks that share all of the meshes.
        parts: the meshes, all of one dimension.
        numbers: the number of each local vertex of a part among those of all ranks and parts, which counts those that a
            rank owns without gaps, part by part.
    """
    counts = [len(part.cells) for part in parts]
    own = np.split(np.arange(sum(counts), dtype=np.int32), np.cumsum(counts)[:-1])
    if compat.TAKES_TOPOLOGY:
        return _from_local(comm, parts, numbers), own
    cells = np.vstack([found[part.cells] for part, found in zip(parts, numbers, strict=True)])
    points = np.vstack([part.points[: part.owned] for part in parts])
    mesh = compat.simplex_mesh(comm, cells, points, parts[0].domain.mesh.topology.cell_name())
    offset = mesh.comm.exscan(sum(counts)) or 0
    places = np.empty(sum(counts), dtype=np.int32)
    places[mesh.topology.original_cell_index[: sum(counts)] - offset] = np.arange(sum(counts))
    return mesh, [places[cells] for cells in own]


def _from_local(comm: MPI.Comm, parts: Sequence[PlacedBody], numbers: Sequence[Integers]) -> dmesh.Mesh:
    """The mesh of local cells and vertices, of these first those that the rank owns. Collective."""
    sizes = [len(found) for found in numbers]
    owned = np.concatenate([np.arange(n) < part.owned for n, part in zip(sizes, parts, strict=True)])
    order, place = np.argsort(~owned, kind="stable"), np.empty(len(owned), dtype=np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    local = np.split(place, np.cumsum(sizes)[:-1])
    inputs, count = np.concatenate(numbers)[order], int(np.count_nonzero(owned))
    owners = np.concatenate([part.domain.mesh.geometry.index_map().owners for part in parts])
    return compat.mesh_of_cells(
        comm,
        np.vstack([part.points for part in parts])[order],
        np.vstack([at[part.cells] for part, at in zip(parts, local, strict=True)]),
        index_map=(count, inputs[count:], owners),
        inputs=inputs,
        facets=_facets(parts, local) if comm.size == 1 else None,
    )


def _facets(parts: Sequence[PlacedBody], local: Sequence[Entities]) -> tuple[Entities, Entities]:
    """All facets by the common vertices, (f, d), and those of each cell, (c, d+1). One rank only."""
    corners, sides, count = [], [], 0
    for part, at in zip(parts, local, strict=True):
        topology, d = part.domain.mesh.topology, part.domain.mesh.topology.dim
        topology.create_connectivity(d - 1, 0)
        topology.create_connectivity(d, d - 1)
        node = np.empty(topology.index_map(0).size_local, dtype=np.int32)
        node[topology.connectivity(d, 0).array] = part.cells.ravel()
        own = topology.connectivity(d - 1, 0).array.reshape(-1, d)
        corners.append(np.sort(at[node[own]], axis=1))
        sides.append(topology.connectivity(d, d - 1).array.reshape(-1, d + 1) + np.int32(count))
        count += len(own)
    return np.vstack(corners), np.vstack(sides)


_NEAREST = 4
"""Cells that are looked at for each point, by their middles."""


def check_places(comm: MPI.Comm, bodies: Sequence[PlacedBody]) -> None:
    """Refuse bodies that overlap. Collective.

    Args:
        comm: the ranks.
        bodies: meshed and in their places.

    Raises:
        InputError: on all ranks alike, with a place.
    """
    own = [body.points[body.cells] for body in bodies]
    boxes = [box(comm, corners.reshape(-1, corners.shape[2])) for corners in own]
    for i, j in permutations(range(len(bodies)), 2):
        low, high = np.maximum(boxes[i][0], boxes[j][0]), np.minimum(boxes[i][1], boxes[j][1])
        if np.all(high - low > ROUNDING * np.max(boxes[i][1] - boxes[i][0])):
            near = (np.all((own[k].max(axis=1) > low) & (own[k].min(axis=1) < high), axis=1) for k in (i, j))
            first, second = (np.concatenate(agree(comm, own[k][here])) for k, here in zip((i, j), near, strict=True))
            at = _inside(first.mean(axis=1), second)
            if len(at):
                raise InputError(
                    f'domain.{bodies[i].name}: at {spot(at[0])} it overlaps the body "{bodies[j].name}"; '
                    "move one of them by its origin, or make them one body"
                )


def _inside(points: Array, cells: Array) -> Array:
    """The points well within a cell: each weight is two fifths of those of its middle; (k, d).

    The facets of curved sides that touch overlap by less.
    """
    if not len(points) or not len(cells):
        return points[:0]
    _, near = cKDTree(cells.mean(axis=1)).query(points, k=list(range(1, min(_NEAREST, len(cells)) + 1)))
    least = barycentric_weights(cells[near], points[:, None]).min(axis=2)
    return points[np.any(5 * cells.shape[1] * least > 2, axis=1)]
