"""A plate of two materials with a hole, on a mesh made by gmsh, pressed onto a floor and pulled along it.

A steel plate with a hole stands on a rubber pad. The pad rests on a floor by contact and friction; the friction drops
to a half where the slip is larger than 5 µm. The pull breaks the friction at the right end only.

    ./hvi exec python3 demos/own_mesh.py [FOLDER]

The pictures plate.png and floor.png go to FOLDER (results/own_mesh by default).
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
from mpi4py import MPI

import hvi_fenicsx as hvi

try:
    from dolfinx.io import gmsh as gmsh_io  # dolfinx 0.10
except ImportError:
    from dolfinx.io import gmshio as gmsh_io  # dolfinx 0.9

WIDTH, HEIGHT, PAD = 0.2, 0.1, 0.02  # m
NAMES = {"floor": 1, "top": 2, "right": 3, "steel": 11, "rubber": 12}
BOXES = {  # x0, y0, x1, y1, m
    "floor": (0.0, -PAD, WIDTH, -PAD),
    "top": (0.0, HEIGHT, WIDTH, HEIGHT),
    "right": (WIDTH, 0.0, WIDTH, HEIGHT),
    "steel": (0.0, 0.0, WIDTH, HEIGHT),
    "rubber": (0.0, -PAD, WIDTH, 0.0),
}


def entities(name: str, dimension: int) -> Iterator[int]:
    """The numbers in gmsh of the lines or surfaces in a box."""
    x0, y0, x1, y1 = BOXES[name]
    found = gmsh.model.getEntitiesInBoundingBox(x0 - 1e-6, y0 - 1e-6, -1e-6, x1 + 1e-6, y1 + 1e-6, 1e-6, dimension)
    return (number for _, number in found)


def tagged_mesh(size: float) -> tuple[Any, Any, Any]:
    """The mesh, the tags of its cells and of its facets."""
    gmsh.initialize()
    gmsh.option.setNumber("General.Verbosity", 1)
    occ = gmsh.model.occ
    plate = occ.addRectangle(0.0, 0.0, 0.0, WIDTH, HEIGHT)
    hole = occ.addDisk(0.5 * WIDTH, 0.6 * HEIGHT, 0.0, 0.02, 0.02)
    steel, _ = occ.cut([(2, plate)], [(2, hole)])
    pad = occ.addRectangle(0.0, -PAD, 0.0, WIDTH, PAD)
    occ.fragment(steel, [(2, pad)])  # the two share the line between them
    occ.synchronize()
    for name, number in NAMES.items():
        dimension = 2 if name in ("steel", "rubber") else 1
        gmsh.model.addPhysicalGroup(dimension, list(entities(name, dimension)), number)
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    gmsh.model.mesh.generate(2)
    mesh, cells, facets = gmsh_io.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=2)[:3]
    gmsh.finalize()
    return mesh, cells, facets


def model(size: float = 0.005) -> hvi.Model:
    mesh, cells, facets = tagged_mesh(size)
    law = hvi.laws.Graph([(0.0, 0.0), (5e-6, 4e5), (5e-6, 2e5)])  # slip in m, traction in N/m²
    return hvi.Model(
        hvi.Body(mesh, facets, cells, names=NAMES),
        [
            hvi.Isotropic(region="steel", youngs_modulus=2.1e11, poisson_ratio=0.3, model="plane_strain"),
            hvi.Isotropic(region="rubber", youngs_modulus=1e9, poisson_ratio=0.4, model="plane_strain"),
            hvi.Traction("top", [0.0, -1e6]),
            hvi.Traction("right", [3e5, 0.0]),
            hvi.Contact("floor"),
            hvi.Friction("floor", law),
        ],
        title="A plate with a hole on a rubber pad",
    )


def main(folder: Path) -> hvi.Solution:
    solution = hvi.solve(model())
    floor = solution.contact["floor"]  # this and pictures are made by all ranks together
    pictures = {"plate": solution.plot("stress"), "floor": solution.plot("contact")}
    if MPI.COMM_WORLD.rank == 0:  # the others have None
        folder.mkdir(parents=True, exist_ok=True)
        for name, figure in pictures.items():
            figure.savefig(folder / f"{name}.png", dpi=100)
        print(solution)
        print(f"largest pressure {floor.pressure.max():.4g} N/m² at x = {floor.x[floor.pressure.argmax(), 0]:.3g} m")
        print(f"broken from x = {floor.x[floor.branch == 1, 0].min():.3g} m on")
    np.testing.assert_allclose(solution.resultant("floor"), [-3e5 * HEIGHT, 1e6 * WIDTH], rtol=1e-6)
    return solution


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "results/own_mesh"))
