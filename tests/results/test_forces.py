"""Why: reactions and loads are what a user reads off to check a result by hand; each against statics.

The forces of all places are in balance; what the table says vertex by vertex adds up to them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from runs import ROOT, hvi, summary, table, write_scene
from scenes import NU, E, P, Q, Table, model

HEADER = "part,x,y,z,u_x,u_y,u_z,traction_x,traction_y,traction_z,reaction_x,reaction_y,reaction_z"
CELLS = 4


def vectors(rows: Any, quantity: str) -> Any:
    return np.stack([rows[quantity + axis] for axis in "xyz"], axis=1)


def run(folder: Path, scene: Table) -> Path:
    path = write_scene(folder / "scene.toml", scene)
    hvi("run", path, "--out", folder / "result", "--no-pictures")
    return folder / "result"


@pytest.fixture(scope="module")
def uniform(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The paper's problem without friction: σ = diag(P, -Q), u = (1 + ν) P/E (x, -y)."""
    assert P == Q
    return run(tmp_path_factory.mktemp("uniform"), model(CELLS))


def test_displacements_and_loads_stand_at_the_vertices_of_each_part(uniform: Path) -> None:
    file = uniform / "boundary.csv"
    assert file.read_text(encoding="utf-8").splitlines()[0] == HEADER
    rows = table(file)
    assert list(rows["part"]) == np.repeat(["wall", "pull", "press", "floor"], CELLS + 1).tolist()
    wanted = (1 + NU) * P / E * np.stack([rows["x"], -rows["y"]], axis=1)
    np.testing.assert_allclose(vectors(rows, "u_")[:, :2], wanted, atol=1e-15)
    traction = vectors(rows, "traction_")
    for part, load in {"pull": [P, 0.0], "press": [0.0, -Q]}.items():
        np.testing.assert_allclose(traction[rows["part"] == part, :2], [load] * (CELLS + 1), atol=1e-6)
    assert np.isnan(traction[np.isin(rows["part"], ("wall", "floor"))]).all()
    assert np.isnan([vectors(rows, quantity)[:, 2] for quantity in ("", "u_", "traction_", "reaction_")]).all()


def test_a_reaction_is_the_stress_on_the_area_of_its_vertex(uniform: Path) -> None:
    rows = table(uniform / "boundary.csv")
    corner = np.isin(rows["x"], (0.0, 1.0)) & np.isin(rows["y"], (0.0, 1.0))
    area = np.where(corner, 0.5, 1.0) / CELLS
    reaction = vectors(rows, "reaction_")[:, :2]
    for part, stress in {"wall": [-P, 0.0], "floor": [0.0, Q], "pull": [0.0, 0.0], "press": [0.0, 0.0]}.items():
        here = rows["part"] == part
        np.testing.assert_allclose(reaction[here], area[here, None] * stress, atol=1e-6 * P)


def test_the_resultants_are_in_the_summary_and_on_the_page(uniform: Path) -> None:
    found = summary(uniform)["resultants"]
    assert list(found) == ["pull", "press", "floor", "wall"]
    for part, force in {"pull": [P, 0.0], "press": [0.0, -Q], "floor": [0.0, Q], "wall": [-P, 0.0]}.items():
        np.testing.assert_allclose(found[part], force, atol=1e-9 * P)
    page = (uniform / "report.html").read_text(encoding="utf-8")
    after = page.partition("Forces on the body")[2].partition("</table>")[0]
    assert ">wall<" in after
    assert ">x, MN/m<" in after
    assert ">−1<" in after


def test_the_rows_of_a_part_add_up_to_its_resultant_and_all_parts_to_nothing(tmp_path: Path) -> None:
    """Of a plate on glue with contact and friction, in space; its pull grows along it, 24 kN in all."""
    folder = tmp_path / "anchor"
    hvi("run", ROOT / "demos/anchor_3d.toml", "--set", "domain.cells=[3, 3, 2]", "--out", folder, "--no-pictures")
    found, rows = summary(folder)["resultants"], table(folder / "boundary.csv")
    np.testing.assert_allclose(found["pull"], [0.0, 0.0, 24e3], atol=1e-3)
    np.testing.assert_allclose(np.sum(list(found.values()), axis=0), 0.0, atol=24e3 * 1e-7)
    base = rows["part"] == "base"
    np.testing.assert_allclose(vectors(rows, "reaction_")[base].sum(axis=0), found["base"], atol=1e-6)
    traction = vectors(rows, "traction_")[rows["part"] == "pull"]
    x = rows["x"][rows["part"] == "pull"]
    inside = np.isclose(x, 0.2 / 3) | np.isclose(x, 0.4 / 3)
    np.testing.assert_allclose(traction[inside, 2], 0.6e6 * (1 + (x[inside] - 0.1) / 0.3), rtol=0.05)


def test_paraview_is_given_the_whole_stress_and_the_reactions_as_vectors(uniform: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    body = pyvista.get_reader(uniform / "displacement.pvd").read()[0]
    assert body.point_data["displacement"].shape == body.point_data["reaction"].shape == (body.n_points, 3)
    stress = body.cell_data["stress"].reshape(-1, 3, 3)
    np.testing.assert_allclose(stress, [np.diag([P, -Q, 0.0])] * body.n_cells, atol=1e-6 * P)
    strain = body.cell_data["strain"].reshape(-1, 3, 3)
    plane = np.diag([P + NU * Q, -Q - NU * P, 0.0]) / E
    np.testing.assert_allclose(strain, [plane] * body.n_cells, atol=1e-6 * P / E)
    x, reaction = body.points, body.point_data["reaction"]
    np.testing.assert_allclose(reaction.sum(axis=0), [-P, Q, 0.0], atol=1e-9 * P)
    assert not reaction[(x[:, 0] > 0) & (x[:, 1] > 0)].any()
