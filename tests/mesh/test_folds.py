"""Folded meshes are refused with the place, whatever the order of the vertices in their cells."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from damage import grid, msh
from dolfinx import mesh as dmesh
from mpi4py import MPI
from runs import hvi, write_scene
from scenes import model

from hvi_fenicsx import Body, InputError, compat
from hvi_fenicsx.mesh.gmsh_arrays import folded_cells
from hvi_fenicsx.typing import Array, Integers


def block(d: int) -> tuple[Array, Integers]:
    """Vertices and cells of a square or cube of 4 x 4 (x 4) cells, those of each cell in any order."""
    make = dmesh.create_unit_square if d == 2 else dmesh.create_unit_cube
    mesh = make(MPI.COMM_SELF, *([4] * d))
    chance = np.random.default_rng(d)
    cells = chance.permuted(compat.geometry_dofmap(mesh).astype(np.int64), axis=1)
    return mesh.geometry.x[:, :d].copy(), cells


@pytest.mark.parametrize("d", [2, 3])
def test_a_mesh_is_folded_where_a_vertex_is_beyond_its_neighbours(d: int) -> None:
    points, cells = block(d)
    chance = np.random.default_rng(7)
    wiggled = points + 0.05 * chance.uniform(-1, 1, points.shape)
    assert len(folded_cells(points, cells)) == 0
    assert len(folded_cells(wiggled, cells)) == 0
    for vertex in chance.choice(len(points), 10, replace=False):
        moved = points.copy()
        moved[vertex] += np.where(points[vertex] < 0.5, 0.6, -0.6)
        at = folded_cells(moved, cells)
        assert np.any(cells[at] == vertex), vertex


def test_a_folded_file_is_bad_input_with_its_place(tmp_path: Path) -> None:
    found = grid()
    inner = next(i for i, (x, y, _) in enumerate(found["nodes"]) if 0 < x < 1 and 0 < y < 1)
    found["nodes"][inner] = [1.6, found["nodes"][inner][1], 0.0]
    (tmp_path / "m.msh").write_bytes(msh(found))
    file = write_scene(tmp_path / "s.toml", model() | {"domain": {"shape": "file", "file": str(tmp_path / "m.msh")}})
    done = hvi("check", file)
    assert done.returncode == 2
    assert "the mesh is folded at (" in done.stderr
    assert "m.msh" in done.stderr


def test_a_folded_mesh_of_a_users_own_is_refused() -> None:
    mesh = dmesh.create_unit_square(MPI.COMM_SELF, 4, 4)
    Body(mesh)
    mesh.geometry.x[np.argmin(np.linalg.norm(mesh.geometry.x - [0.5, 0.5, 0], axis=1)), 0] = 0.9
    with pytest.raises(InputError, match=r"folded at \("):
        Body(mesh)
