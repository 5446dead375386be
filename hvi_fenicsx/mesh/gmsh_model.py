"""How a mesh that gmsh has made becomes a dolfinx mesh: sides and regions are its named physical groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..typing import Entities
from . import gmsh_arrays
from .gmsh_arrays import MeshArrays


@contextmanager
def session(comm: MPI.Comm) -> Iterator[Any]:
    """The gmsh module, started on rank 0 only (None elsewhere) and always finalised."""
    if comm.rank != 0:
        yield None
        return
    import gmsh

    gmsh_arrays.start(gmsh)
    try:
        yield gmsh
    finally:
        gmsh.finalize()


def distribute(
    comm: MPI.Comm, found: MeshArrays | None, dimension: int, names: Mapping[int, Mapping[str, int]]
) -> tuple[dmesh.Mesh, dict[str, Entities], dict[str, Entities]]:
    """A mesh that rank 0 has, shared among the ranks. Collective.

    Args:
        comm: the ranks.
        found: the mesh; None on the other ranks.
        dimension: of the cells.
        names: physical groups of facets and of cells with their tags, by dimension; on all ranks.

    Returns:
        Mesh, sides and regions (local facets and cells by name).
    """
    found = found or MeshArrays.empty(dimension)
    kind = "triangle" if dimension == 2 else "tetrahedron"
    mesh = compat.simplex_mesh(comm, found.cells, found.points[:, :dimension], kind, spread=True)
    cells = np.arange(mesh.topology.index_map(dimension).size_local, dtype=np.int32)
    tags = comm.bcast(found.cell_tags)[mesh.topology.original_cell_index[cells]]
    local, marks = compat.local_entities(mesh, dimension - 1, found.facets, found.facet_tags)
    return mesh, _by_name(local, marks, names[dimension - 1]), _by_name(cells, tags, names[dimension])


def _by_name(entities: Entities, tags: Entities, names: Mapping[str, int]) -> dict[str, Entities]:
    """Local entities by the names of their tags."""
    return {name: np.unique(entities[tags == tag]) for name, tag in names.items()}
