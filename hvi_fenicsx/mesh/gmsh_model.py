"""How a mesh that gmsh has made becomes a dolfinx mesh: sides and regions are its named physical groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..typing import Entities, Integers
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
    """A mesh that one rank has, shared among the ranks. Collective.

    Args:
        comm: the ranks.
        found: the mesh; None on the ranks that do not have it.
        dimension: of the cells.
        names: physical groups of facets and of cells with their tags, by dimension; on all ranks.

    Returns:
        Mesh, sides and regions (local facets and cells by name).
    """
    found = found or MeshArrays.empty(dimension)
    kind = "triangle" if dimension == 2 else "tetrahedron"
    mesh = compat.simplex_mesh(comm, found.cells, found.points[:, :dimension], kind, spread=True)
    regions = _by_name(mesh, dimension, found.cells, found.cell_tags, names)
    sides = _by_name(mesh, dimension - 1, found.facets, found.facet_tags, names)
    return mesh, sides, regions


def _by_name(
    mesh: dmesh.Mesh, dimension: int, nodes: Integers, tags: Entities, names: Mapping[int, Mapping[str, int]]
) -> dict[str, Entities]:
    local, found = compat.local_entities(mesh, dimension, nodes, tags)
    return {name: np.unique(local[found == tag]) for name, tag in names[dimension].items()}
