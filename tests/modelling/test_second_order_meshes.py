"""Dolfinx meshes of second order as bodies: Lamé's wall, data on the user's own mesh, ranks, what is refused."""

from __future__ import annotations

from typing import Any

import basix.ufl
import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from round_walls import RUBBER, SYMMETRY, P, body, lame, wall

import hvi_fenicsx as hvi

EXACT = -0.25 * np.pi * P * lame(np.array(1.0))


def solved(made: hvi.Body, load: Any = P, degree: int = 2) -> hvi.Solution:
    found = hvi.solve(hvi.Model(made, [RUBBER, *SYMMETRY, hvi.Pressure("inner", load)]), degree=degree)
    assert found.certificate.passed
    return found


def test_a_mesh_of_second_order_has_curved_cells() -> None:
    curved, straight = (solved(body(wall(MPI.COMM_SELF, 8, order))) for order in (2, 1))
    error = abs(curved.energy / EXACT - 1)
    assert error < 0.03 * abs(straight.energy / EXACT - 1)
    assert curved.estimate is not None
    assert curved.estimate.relative == pytest.approx(np.sqrt(error), rel=0.1)
    x = curved.problem.positions[:, :2]
    r = np.linalg.norm(x, axis=1, keepdims=True)
    assert np.abs(curved.u.x.array.reshape(-1, 2) - lame(r) * x / r).max() < 2e-3 * lame(np.array(1.0))


@pytest.mark.parametrize("degree", [1, 2])
def test_loads_may_be_on_the_mesh_of_the_user_or_on_that_of_the_body(degree: int) -> None:
    made = wall(MPI.COMM_SELF, 4, 2)
    given = body(made)
    own, straight = (P * (1 + ufl.SpatialCoordinate(m)[0]) for m in (made, given.mesh))
    on_nodes = fem.Function(fem.functionspace(made, ("Lagrange", 2)))
    on_nodes.interpolate(lambda x: P * (1 + x[0]))
    loads = [f"{P}*(1 + x)", own, straight, *([on_nodes] if degree == 2 else [])]
    energies = [solved(given, load, degree).energy for load in loads]
    assert energies[1:] == pytest.approx(energies[:1] * (len(loads) - 1), rel=1e-11)


def test_cells_of_third_order_and_curves_that_turn_back_are_refused() -> None:
    element = basix.ufl.element("Lagrange", "triangle", 3, basix.LagrangeVariant.gll_warped, shape=(2,))
    points = np.asarray(element.basix_element.points)
    cubic = mesh.create_mesh(MPI.COMM_SELF, cells=np.arange(10)[None], x=points, e=element)
    with pytest.raises(hvi.InputError, match="order 3"):
        hvi.Body(cubic)
    made = wall(MPI.COMM_SELF, 2, 2)
    x = made.geometry.x
    middle = np.argmin(np.linalg.norm(x - [np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0], axis=1))
    x[middle] = [0.95, 0.12, 0.0]
    with pytest.raises(hvi.InputError, match=r"'inner'.*turns back; remesh"):
        body(made)
