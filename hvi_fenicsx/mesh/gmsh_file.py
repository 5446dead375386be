"""A gmsh file as a domain."""

from __future__ import annotations

from pathlib import Path

from mpi4py import MPI

from . import gmsh_model
from .domain import Domain


def read(comm: MPI.Comm, path: Path, dimension: int, scale: float = 1.0) -> Domain:
    """The mesh of a file, its physical groups being sides and regions. Collective.

    Args:
        comm: the ranks that share the mesh.
        path: the file.
        dimension: of the cells, 2 or 3.
        scale: m per unit of the file's coordinates.

    Raises:
        InputError: on all ranks alike, when the file cannot be read or is no usable mesh.
    """
    mesh, sides, regions = gmsh_model.read(comm, path, dimension)
    mesh.geometry.x[:] *= scale
    return Domain.from_mesh(mesh, sides, regions)
