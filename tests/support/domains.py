"""Bodies to refine, and what is measured of meshes and of fields taken from one to another. Collective."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem, la
from dolfinx import mesh as dmesh
from mpi4py import MPI
from petsc4py import PETSc

from hvi_fenicsx.mesh import refinement
from hvi_fenicsx.mesh.blocks import block
from hvi_fenicsx.mesh.domain import Domain
from hvi_fenicsx.mesh.refinement import Refinement
from hvi_fenicsx.mesh.shapes import HalfDisk

COMM = MPI.COMM_WORLD


def rectangle() -> Domain:
    return block(COMM, [1.0, 2.0], [3, 5])


def box() -> Domain:
    return block(COMM, [1.0, 2.0, 0.5], [2, 3, 2])


def half_disk() -> Domain:
    return HalfDisk(radius=0.5, mesh_size=0.2).build(COMM, 2)


BODIES: list[Callable[[], Domain]] = [rectangle, box, half_disk]


def near(body: Domain, point: npt.NDArray[np.float64], radius: float) -> npt.NDArray[np.int32]:
    """Local cells whose middle is so near to a point."""
    count = body.mesh.topology.index_map(body.dimension).size_local
    middles = dmesh.compute_midpoints(body.mesh, body.dimension, np.arange(count, dtype=np.int32))
    return np.flatnonzero(np.linalg.norm(middles[:, : len(point)] - point, axis=1) < radius).astype(np.int32)


def towards(body: Domain, point: npt.NDArray[np.float64], steps: int) -> list[Refinement]:
    """Refinements around a point, each on half the radius of the one before."""
    found: list[Refinement] = []
    for step in range(steps):
        found.append(refinement.marked(body, near(body, point, 0.8 * 0.6**step)))
        body = found[-1].domain
    return found


def measure(body: Domain, name: str) -> float:
    """Length or area of a side."""
    facets = np.sort(body.sides[name])
    tags = dmesh.meshtags(body.mesh, body.dimension - 1, facets, np.ones(len(facets), dtype=np.int32))
    ds = ufl.Measure("ds", domain=body.mesh, subdomain_data=tags)(1)
    return float(COMM.allreduce(fem.assemble_scalar(fem.form(fem.Constant(body.mesh, 1.0) * ds))))


def volume(body: Domain) -> float:
    dx = ufl.Measure("dx", domain=body.mesh)
    return float(COMM.allreduce(fem.assemble_scalar(fem.form(fem.Constant(body.mesh, 1.0) * dx))))


def ghosts_apart(body: Domain) -> float:
    """The largest distance of a ghost node from where the rank that owns it has it."""
    x = body.mesh.geometry.x
    owners = la.vector(body.mesh.geometry.index_map(), 3, dtype=np.float64)
    owners.array[:] = x.ravel()
    owners.scatter_forward()
    return float(COMM.allreduce(float(np.max(np.abs(owners.array - x.ravel()), initial=0.0)), op=MPI.MAX))


def rough(x: np.ndarray) -> np.ndarray:
    """A field that is not in the coarse space."""
    rows = [np.abs(x[0] - 0.3) + x[1] ** 2, np.sin(3 * x[0] * x[1]), x[2] ** 2 + np.abs(x[0] - x[1])]
    return np.array(rows)


def lost(step: PETSc.Mat, fine: fem.FunctionSpace, coarse: fem.FunctionSpace, *, linear: bool = False) -> float:
    """Largest difference of a prolonged field, rough or linear, from its interpolation."""
    known = fem.Function(coarse)
    known.interpolate(lambda x: ((x[[1, 2, 0]] - x) if linear else rough(x))[: coarse.mesh.geometry.dim])
    column = step.createVecRight()
    column.array[:] = known.x.array[: column.local_size]
    return float(np.max(np.abs((step * column).array - interpolated(fine, known))))


def space_on(mesh: dmesh.Mesh) -> fem.FunctionSpace:
    """P1 vectors."""
    return fem.functionspace(mesh, ("Lagrange", 1, (mesh.geometry.dim,)))


def interpolated(fine: fem.FunctionSpace, known: fem.Function) -> Any:
    cells = np.arange(fine.mesh.topology.index_map(fine.mesh.topology.dim).size_local, dtype=np.int32)
    data = fem.create_interpolation_data(fine, known.function_space, cells, padding=1e-10)
    result = fem.Function(fine)
    result.interpolate_nonmatching(known, cells, data)
    return result.x.array[: fine.dofmap.index_map.size_local * fine.dofmap.index_map_bs]
