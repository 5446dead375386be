"""A mesh with tags, as a FEniCSx user makes it, and the paper's problem on it."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from dolfinx import mesh
from mpi4py import MPI

import hvi_fenicsx as hvi

TAGS = {"wall": 1, "pull": 2, "press": 3, "floor": 4}
STEEL = hvi.Isotropic(youngs_modulus=2.15e11, poisson_ratio=0.29)
LAW = hvi.laws.QuadraticLinear(gamma1=1e6, gamma2=5e5, delta=9e-6)


def tagged_square(comm: MPI.Comm, cells: int = 8) -> tuple[mesh.Mesh, mesh.MeshTags]:
    """The unit square, its sides tagged as TAGS."""
    square = mesh.create_unit_square(comm, cells, cells)
    sides: dict[int, Any] = {1: (0, 0.0), 2: (0, 1.0), 3: (1, 1.0), 4: (1, 0.0)}
    found = {tag: mesh.locate_entities_boundary(square, 1, near(*at)) for tag, at in sides.items()}
    facets = np.concatenate(list(found.values()))
    values = np.concatenate([np.full(len(f), tag, dtype=np.int32) for tag, f in found.items()])
    order = np.argsort(facets)
    return square, mesh.meshtags(square, 1, facets[order], values[order])


def near(axis: int, value: float) -> Any:
    def marker(x: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
        return np.isclose(x[axis], value)

    return marker


def own_square(comm: MPI.Comm = MPI.COMM_SELF, cells: int = 8) -> hvi.Body:
    """The body of that mesh."""
    square, tags = tagged_square(comm, cells)
    return hvi.Body(square, facets=tags, names=TAGS)


def steel_square(
    comm: MPI.Comm = MPI.COMM_SELF, body: hvi.Body | None = None, material: Any = STEEL, press: Any = (0.0, -1e6)
) -> hvi.Model:
    """The paper's problem with a law that matters; parts of the floor have slipped beyond its drop."""
    return hvi.Model(
        body or own_square(comm),
        [
            material,
            hvi.Displacement("wall", [0.0, None]),
            hvi.Traction("pull", [3e6, 0.0]),
            hvi.Traction("press", press),
            hvi.Contact("floor"),
            hvi.Friction("floor", LAW),
        ],
    )
