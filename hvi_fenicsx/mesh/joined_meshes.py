"""One mesh of the cells of several: each rank keeps its own, in their order, and nothing is searched for or sent."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..typing import Array, Entities, Integers


@dataclass(frozen=True)
class PlacedMesh:
    """A mesh without ghost cells, and where its vertices are.

    Attributes:
        mesh: of straight simplices.
        points: its local vertices, those of the geometry, in their place, m, (n, d).
    """

    mesh: dmesh.Mesh
    points: Array

    @property
    def owned(self) -> int:
        """Vertices that this rank owns."""
        return int(self.mesh.geometry.index_map().size_local)

    @property
    def cells(self) -> Entities:
        """This rank's cells by the local vertices, (c, d+1)."""
        topology = self.mesh.topology
        return np.asarray(compat.geometry_dofmap(self.mesh)[: topology.index_map(topology.dim).size_local])


def common_mesh(
    comm: MPI.Comm, parts: Sequence[PlacedMesh], numbers: Sequence[Integers]
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
    mesh = compat.simplex_mesh(comm, cells, points, parts[0].mesh.topology.cell_name())
    offset = mesh.comm.exscan(sum(counts)) or 0
    places = np.empty(sum(counts), dtype=np.int32)
    places[np.asarray(mesh.topology.original_cell_index)[: sum(counts)] - offset] = np.arange(sum(counts))
    return mesh, [places[cells] for cells in own]


def _from_local(comm: MPI.Comm, parts: Sequence[PlacedMesh], numbers: Sequence[Integers]) -> dmesh.Mesh:
    """The mesh of local cells and vertices, of these first those that the rank owns. Collective."""
    owned, ghosts = [part.owned for part in parts], [len(part.points) - part.owned for part in parts]
    first = np.concatenate([[0], np.cumsum(owned)])
    last = first[-1] + np.concatenate([[0], np.cumsum(ghosts)])
    local = [
        np.concatenate([np.arange(n) + at, np.arange(m) + behind]).astype(np.int32)
        for n, m, at, behind in zip(owned, ghosts, first, last, strict=False)
    ]
    split = [(found[:n], found[n:]) for found, n in zip(numbers, owned, strict=True)]
    places = [(part.points[:n], part.points[n:]) for part, n in zip(parts, owned, strict=True)]
    others = np.concatenate([there for _, there in split])
    owners = np.concatenate([np.asarray(part.mesh.geometry.index_map().owners) for part in parts])
    return compat.mesh_of_cells(
        comm,
        np.vstack([*(here for here, _ in places), *(there for _, there in places)]),
        np.vstack([at[part.cells] for part, at in zip(parts, local, strict=True)]),
        index_map=(int(first[-1]), others.astype(np.int64), owners.astype(np.int32)),
        inputs=np.concatenate([*(here for here, _ in split), others]).astype(np.int64),
        facets=_facets(parts, local) if comm.size == 1 else None,
    )


def _facets(parts: Sequence[PlacedMesh], local: Sequence[Entities]) -> tuple[Entities, Entities]:
    """All facets by the common vertices, (f, d), and those of each cell, (c, d+1). One rank only."""
    corners, sides, count = [], [], 0
    for part, at in zip(parts, local, strict=True):
        topology, d = part.mesh.topology, part.mesh.topology.dim
        topology.create_connectivity(d - 1, 0)
        topology.create_connectivity(d, d - 1)
        node = np.empty(topology.index_map(0).size_local, dtype=np.int32)
        node[topology.connectivity(d, 0).array] = part.cells.ravel()
        own = topology.connectivity(d - 1, 0).array.reshape(-1, d)
        corners.append(np.sort(at[node[own]], axis=1))
        sides.append(topology.connectivity(d, d - 1).array.reshape(-1, d + 1) + np.int32(count))
        count += len(own)
    return np.vstack(corners), np.vstack(sides)
