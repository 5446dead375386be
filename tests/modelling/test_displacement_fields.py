"""The displacement of a solution as other programs read it, and as the start of a solve at another degree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import pyvista
from dolfinx import io

import hvi_fenicsx as hvi
from hvi_fenicsx.typing import Array

E, WEIGHT = 2e9, 1e6


def column(dimension: int) -> hvi.Model:
    """A square or cube under its own weight on a floor, ν = 0: the displacement is quadratic in height."""
    body = hvi.Body.rectangle([1.0, 1.0], [3, 3]) if dimension == 2 else hvi.Body.box([1.0, 1.0, 1.0], [2, 2, 3])
    *sideways, _ = [0.0] * dimension
    steel = hvi.Isotropic(youngs_modulus=E, poisson_ratio=0.0)
    held = [hvi.Displacement("left", [0.0] + [None] * (dimension - 1))]
    if dimension == 3:
        held.append(hvi.Displacement("front", [None, 0.0, None]))
    return hvi.Model(body, [steel, hvi.BodyForce([*sideways, -WEIGHT]), hvi.Contact("bottom"), *held])


def sinking(height: Array) -> Array:
    """How far the column sinks, m."""
    return np.asarray(-WEIGHT / E * (height - height**2 / 2))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("degree", [1, 2])
def test_coefficients_are_values_at_the_nodes(dimension: int, degree: int) -> None:
    u = hvi.solve(column(dimension), degree=degree, estimate=False).u
    height = u.function_space.tabulate_dof_coordinates()[:, dimension - 1]
    found = u.x.array.reshape(-1, dimension)[:, dimension - 1]
    np.testing.assert_allclose(found, sinking(height), atol=1e-9 if degree == 2 else 3e-5)


@pytest.mark.parametrize("degree", [1, 2])
def test_a_file_that_dolfinx_writes_of_it_has_them(degree: int, tmp_path: Path) -> None:
    u = hvi.solve(column(3), degree=degree, estimate=False).u
    with io.VTKFile(u.function_space.mesh.comm, tmp_path / "u.pvd", "w") as file:
        file.write_function(u)
    grid = pyvista.read(tmp_path / "u.pvd")[0]
    np.testing.assert_allclose(
        grid["displacement"][:, 2], sinking(grid.points[:, 2]), atol=1e-9 if degree == 2 else 3e-5
    )


def test_a_path_is_followed_at_another_degree_and_its_rows_have_values() -> None:
    path = hvi.follow(column(3), degree=2, tolerance=1e-10)
    u = path.u(-1)
    height = u.function_space.tabulate_dof_coordinates()[:, 2]
    np.testing.assert_allclose(u.x.array.reshape(-1, 3)[:, 2], sinking(height), atol=1e-9)
    np.testing.assert_array_equal(path.u(-1).x.array, path.u(len(path.rows) - 1).x.array)
    with pytest.raises(hvi.InputError, match=f"there is no row 1000; there are rows 0 to {len(path.rows) - 1}"):
        path.u(1000)
