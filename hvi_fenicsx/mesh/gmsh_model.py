"""The mesh in gmsh's model, and how it becomes a dolfinx mesh: sides and regions are its named physical groups."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from dolfinx import mesh as dmesh
from mpi4py import MPI

from .. import compat
from ..typing import Entities


@contextmanager
def session(comm: MPI.Comm) -> Iterator[Any]:
    """The gmsh module, started on rank 0 only (None elsewhere) and always finalised."""
    if comm.rank != 0:
        yield None
        return
    import gmsh

    start(gmsh)
    try:
        yield gmsh
    finally:
        gmsh.finalize()


def start(gmsh: Any) -> None:
    """Start gmsh without the user's settings, and without its own messages."""
    gmsh.initialize(["-noenv"], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)


def distribute(
    comm: MPI.Comm, gmsh: Any, dimension: int, names: Mapping[int, Mapping[str, int]]
) -> tuple[dmesh.Mesh, dict[str, Entities], dict[str, Entities]]:
    """The mesh that is open in rank 0's gmsh, shared among the ranks. Collective.

    Args:
        comm: the ranks.
        gmsh: the module, see :func:`session`.
        dimension: of the cells.
        names: physical groups of facets and of cells with their tags, by dimension; on all ranks.

    Returns:
        Mesh, sides and regions (local facets and cells by name).
    """
    model = gmsh.model if comm.rank == 0 else None
    mesh, cell_tags, facet_tags = compat.mesh_from_gmsh(model, comm, 0, dimension)
    mesh.topology.create_connectivity(dimension - 1, dimension)
    return mesh, _by_name(facet_tags, names[dimension - 1]), _by_name(cell_tags, names[dimension])


def _by_name(tags: Any, names: Mapping[str, int]) -> dict[str, Entities]:
    return {name: tags.find(tag) for name, tag in names.items()}
