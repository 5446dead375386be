"""Why: at degree 2 the stress is linear in each cell; its mean alone throws away what the degree was paid for.

A bar in pure bending has a quadratic displacement, which degree 2 represents exactly: its stress is known everywhere.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista
import rings
from dolfinx import fem

import hvi_fenicsx as hvi
from hvi_fenicsx.typing import Array

E, NU, TURN = 2e9, 0.3, 1e-3
BENT = {
    2: [f"{TURN}*x*y", f"-{TURN}/2*(x*x + {NU}*y*y)"],
    3: [f"{TURN}*x*z", f"-{NU * TURN}*y*z", f"-{TURN}/2*(x*x + {NU}*z*z - {NU}*y*y)"],
}
"""The displacement of a bar that is bent by a curvature in 1/m: plane stress, and space."""


def bent(dimension: int) -> hvi.Solution:
    """A bar whose whole surface is moved as bending moves it."""
    size, cells = [3.0, 1.0, 1.0], [4, 2, 2]
    body = hvi.Body.rectangle(size[:2], cells[:2]) if dimension == 2 else hvi.Body.box(size, cells)
    model = "plane_stress" if dimension == 2 else "three_dimensional"
    material = hvi.Isotropic(youngs_modulus=E, poisson_ratio=NU, model=model)
    moved = [hvi.Displacement(side, BENT[dimension]) for side in body.sides]
    return hvi.solve(hvi.Model(body, [material, *moved]), degree=2)


def bending(points: Array, dimension: int) -> Array:
    """The stress at points, N/m², (n, 3, 3)."""
    found = np.zeros((len(points), 3, 3))
    found[:, 0, 0] = E * TURN * points[:, dimension - 1]
    return found


@pytest.mark.parametrize("dimension", [2, 3])
def test_the_stress_of_a_bent_bar_is_linear_in_each_cell(dimension: int) -> None:
    stress = bent(dimension).stress
    places = fem.functionspace(stress.function_space.mesh, ("Discontinuous Lagrange", 1)).tabulate_dof_coordinates()
    values = stress.x.array.reshape(-1, 3, 3)
    np.testing.assert_allclose(values, bending(places, dimension), atol=1e-8 * E * TURN)


@pytest.mark.parametrize("dimension", [2, 3])
def test_each_part_of_a_cell_in_the_files_has_its_own_stress_and_strain(dimension: int, tmp_path: Path) -> None:
    bent(dimension).write(tmp_path / "bent", pictures=False)
    body = pyvista.get_reader(tmp_path / "bent" / "displacement.pvd").read()[0]
    exact = bending(body.cell_centers().points, dimension)
    np.testing.assert_allclose(body["stress"].reshape(-1, 3, 3), exact, atol=1e-6 * E * TURN)
    np.testing.assert_allclose(body["von_mises"], np.abs(exact[:, 0, 0]), atol=1e-6 * E * TURN)
    np.testing.assert_allclose(body["strain"][:, 0], exact[:, 0, 0] / E, atol=1e-6 * TURN)


def test_in_a_wall_under_pressure_its_error_falls_with_the_square_of_the_mesh_width() -> None:
    """Lamé's ring, whose cells are curved."""
    first, second = (rings.errors(rings.solved(rings.RING.format(size=1 / n, order=2))).stress for n in (4, 8))
    assert second < 0.005
    assert first / second > 3.2
