"""Why: a point put into a neighbouring cell is interpolated all the same, only a little wrong; so is one outside."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import mesh as dmesh
from mpi4py import MPI

from hvi_fenicsx import compat
from hvi_fenicsx.mesh import transfer

COMM = MPI.COMM_SELF


def bodies() -> list[dmesh.Mesh]:
    return [dmesh.create_unit_square(COMM, 5, 4), dmesh.create_unit_cube(COMM, 3, 2, 2)]


@pytest.mark.parametrize("mesh", bodies(), ids=["plane", "space"])
def test_a_point_lies_in_the_cell_that_is_said_to_hold_it(mesh: dmesh.Mesh) -> None:
    d = mesh.topology.dim
    points = np.zeros((200, 3))
    points[:, :d] = np.random.default_rng(2).uniform(size=(200, d))
    found = transfer.containing_cells(mesh, points)
    corners = mesh.geometry.x[compat.geometry_dofmap(mesh)[found]][:, :, :d]
    weights = transfer.barycentric_weights(corners, points[:, :d])
    assert weights.min() >= -1e-12
    np.testing.assert_allclose(np.einsum("mc,mcd->md", weights, corners), points[:, :d], atol=1e-13)


@pytest.mark.parametrize("mesh", bodies(), ids=["plane", "space"])
def test_a_point_outside_belongs_to_the_nearest_cell(mesh: dmesh.Mesh) -> None:
    """Beside the middle of a side, so that the nearest cell is that of its foot on the side."""
    d = mesh.topology.dim
    foot = np.array([1.0, 0.3, 0.3])[:d]
    point = np.zeros((1, 3))
    point[0, :d] = foot + np.eye(d)[0] * 0.05
    found = transfer.containing_cells(mesh, point)
    corners = mesh.geometry.x[compat.geometry_dofmap(mesh)[found]][:, :, :d]
    near = transfer.clipped(transfer.barycentric_weights(corners, point[:, :d]))
    np.testing.assert_allclose(np.einsum("mc,mcd->md", near, corners)[0], foot, atol=0.1)
    assert np.count_nonzero(np.isclose(corners[0, :, 0], 1.0)) >= d


def test_the_nearest_cell_need_not_be_the_one_whose_box_holds_the_point() -> None:
    """Beside the long side of a large triangle, within its box, with a small triangle nearer by."""
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [0.0, 2.0], [1.5, 1.5], [1.6, 1.5], [1.5, 1.6]])
    mesh = compat.simplex_mesh(COMM, np.array([[0, 1, 2], [3, 4, 5]]), corners, "triangle")
    found = transfer.containing_cells(mesh, np.array([[1.4, 1.4, 0.0], [0.5, 0.5, 0.0]]))
    assert mesh.topology.original_cell_index[found].tolist() == [1, 0]
