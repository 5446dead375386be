"""One code base for dolfinx 0.9 to 0.11: every difference between them lives here, found by feature."""

from __future__ import annotations

from typing import Any

import dolfinx
import numpy as np
import numpy.typing as npt
from dolfinx import mesh as _mesh
from petsc4py import PETSc

VERSION: str = dolfinx.__version__

if hasattr(dolfinx.io, "gmsh"):
    from dolfinx.io import gmsh as gmsh_io
else:
    from dolfinx.io import gmshio as gmsh_io


def geometry_dofmap(mesh: _mesh.Mesh) -> npt.NDArray[np.int32]:
    """Geometry nodes of each cell, shape (cells, nodes)."""
    geometry = mesh.geometry
    return geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap


def mesh_from_gmsh(model: Any, comm: Any, rank: int, dimension: int) -> tuple[Any, Any, Any]:
    """Mesh, cell tags and facet tags of the gmsh model open on ``rank``. Collective."""
    return tuple(gmsh_io.model_to_mesh(model, comm, rank, gdim=dimension)[:3])


def submesh_nodes(mesh: _mesh.Mesh, dimension: int, entities: npt.NDArray[np.int32]) -> tuple[Any, Any]:
    """Submesh of the entities, and for each of its geometry nodes the node of ``mesh``. Collective."""
    result = _mesh.create_submesh(mesh, dimension, entities)
    return result[0], np.asarray(result[3])


def petsc_version() -> str:
    """PETSc's version, as text."""
    return ".".join(str(n) for n in PETSc.Sys.getVersion())
