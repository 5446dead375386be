"""A quarter of a thick round wall as a dolfinx mesh of second order, made without gmsh; on ranks, what it gives."""

from __future__ import annotations

import json
from typing import Any

import basix.ufl
import numpy as np
import numpy.typing as npt
from dolfinx import mesh
from mpi4py import MPI

import hvi_fenicsx as hvi

E, NU, P = 1e7, 0.3, 1e5
NAMES = {"left": 1, "bottom": 2, "inner": 3, "outer": 4}
RUBBER = hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, model="plane_strain")
SYMMETRY = [hvi.Displacement("bottom", [None, 0.0]), hvi.Displacement("left", [0.0, None])]


def lame(r: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The radial displacement under pressure inside, radii 1 and 2 (Lamé)."""
    return (1 + NU) / E * P / 3 * ((1 - 2 * NU) * r + 4 / r)


def wall(comm: MPI.Comm, cells: int, order: int) -> mesh.Mesh:
    """The wall, of cells both ways, radii 1 and 2; its nodes are given on rank 0."""
    n = order * cells + 1
    r, angle = np.meshgrid(np.linspace(1, 2, n), np.linspace(0, np.pi / 2, n), indexing="ij")
    points = np.column_stack([(r * np.cos(angle)).ravel(), (r * np.sin(angle)).ravel()])
    corner = (order * n * np.arange(cells)[:, None] + order * np.arange(cells)[None, :]).ravel()
    right, up = order * n, order
    triangles = [(0, right, right + up), (0, right + up, up)]
    nodes = np.array([[*t, *_middles(*t)] if order == 2 else t for t in triangles])
    found = (corner[:, None, None] + nodes).reshape(-1, nodes.shape[1]).astype(np.int64)
    if comm.rank:
        points, found = points[:0], found[:0]
    element = basix.ufl.element("Lagrange", "triangle", order, shape=(2,))
    return mesh.create_mesh(comm, cells=found, x=points, e=element)


def _middles(a: int, b: int, c: int) -> tuple[int, int, int]:
    return (b + c) // 2, (a + c) // 2, (a + b) // 2


def sides(made: mesh.Mesh) -> Any:
    """The tags of the sides, found by the middles of the facets."""
    made.topology.create_connectivity(1, 2)
    facets = mesh.exterior_facet_indices(made.topology)
    x, y = mesh.compute_midpoints(made, 1, facets)[:, :2].T
    r = np.hypot(x, y)
    tags = np.where(np.abs(x) < 1e-9, 1, np.where(np.abs(y) < 1e-9, 2, np.where(r < 1.5, 3, 4)))
    return mesh.meshtags(made, 1, facets, tags.astype(np.int32))


def body(made: mesh.Mesh) -> hvi.Body:
    """The body of a mesh of the wall."""
    return hvi.Body(made, facets=sides(made), names=NAMES)


if __name__ == "__main__":
    world = MPI.COMM_WORLD
    solved = hvi.solve(hvi.Model(body(wall(world, 8, 2)), [RUBBER, *SYMMETRY, hvi.Pressure("inner", P)]), degree=2)
    energies = world.gather([solved.energy, solved.certificate.passed])
    if world.rank == 0:
        print(json.dumps(energies))
