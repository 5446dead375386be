"""Gmsh files as bodies: groups become boundary parts and regions, and the rectangle's answers hold on any mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from runs import contact, hvi, write_scene
from scenes import NU, STEEL, E, P, Q, Table, displacement, energy, far, model, points, quadratic_linear, solved


def on_file(file: Path, table: Table, **domain: Any) -> Table:
    return table | {"domain": {"shape": "file", "file": str(file), **domain}}


@pytest.fixture(scope="module")
def square(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return meshes.make(tmp_path_factory.mktemp("mesh") / "square.msh", meshes.GOOD)


def test_a_gmsh_square_has_the_closed_form_of_the_rectangle(square: Path) -> None:
    found = solved(on_file(square, model()))
    x = points(found)
    assert len(x) > 30
    wanted = np.column_stack([(P + NU * Q) / E * x[:, 0], -(Q + NU * P) / E * x[:, 1]])
    assert far(displacement(found), wanted) < 1e-9
    assert energy(found) == pytest.approx(-6.0, rel=1e-9)


def test_with_friction_it_tends_to_what_the_rectangle_tends_to(tmp_path: Path) -> None:
    """Two families of meshes, one limit: the difference falls with the size of the cells."""
    gaps = []
    for cells in (5, 20):
        file = meshes.make(tmp_path / f"{cells}.msh", meshes.GOOD.replace("0.2", str(1 / cells)))
        table = model(cells, 3e6, Q, quadratic_linear(1e6))
        gaps.append(abs(energy(solved(on_file(file, table))) / energy(solved(table)) - 1))
    assert gaps[1] < gaps[0] / 4 < 5e-3


def test_a_mesh_in_millimetres_is_scaled(square: Path, tmp_path: Path) -> None:
    file = meshes.transformed(tmp_path / "mm.msh", square, [1e3, 0, 0, 0, 0, 1e3, 0, 0, 0, 0, 1e3, 0])
    found = solved(on_file(file, model(), scale=1e-3))
    assert np.max(points(found)) == pytest.approx(1.0)
    assert energy(found) == pytest.approx(-6.0, rel=1e-9)


def test_two_materials_side_by_side_stretch_each_by_its_modulus(tmp_path: Path) -> None:
    """ν = 0, pulled along both: u1 is linear in each half, at twice the slope in the softer one."""
    file = meshes.make(tmp_path / "halves.msh", meshes.HALVES)
    table = on_file(file, model(press=0.0))
    bar = STEEL | {"poisson_ratio": 0.0}
    table["material"] = {
        "a": bar | {"region": "soft", "youngs_modulus": E / 2},
        "b": bar | {"region": "hard", "youngs_modulus": E},
    }
    found = solved(table)
    x = points(found)
    wanted = P / E * (2 * np.minimum(x[:, 0], 0.5) + np.maximum(x[:, 0] - 0.5, 0.0))
    assert far(displacement(found)[:, 0], wanted) < 1e-9


def test_a_force_in_one_region_weighs_as_much_as_that_region(tmp_path: Path) -> None:
    file = meshes.make(tmp_path / "halves.msh", meshes.HALVES)
    table = on_file(file, model(press=0.0))
    table["material"] = {"a": STEEL | {"region": ["soft", "hard"]}}
    table["body"] = {"weight": {"region": "hard", "force": [0.0, -8.0e5]}, "all": {"force": [0.0, "-2e5 + 0*x"]}}
    found = solved(table)
    assert found.examination is not None
    state = found.examination.states[0]
    bearing = np.sum(state.surface.weights * state.pressure) * found.problem.scales.stress
    assert bearing == pytest.approx(-6.0e5, rel=1e-9)


def test_a_floor_of_two_groups_is_one_part(tmp_path: Path) -> None:
    """The bottom in two pieces, named together: weights, order and arc length run through."""
    file = meshes.make(tmp_path / "halves.msh", meshes.HALVES + _SPLIT)
    table = on_file(file, model())
    table["material"] = {"a": STEEL | {"region": ["soft", "hard"]}}
    table["boundary"]["floor"]["on"] = ["first", "second"]
    out = tmp_path / "r"
    done = hvi("run", write_scene(tmp_path / "s.toml", table), "--out", out, "--no-pictures")
    assert done.returncode == 0, done.stderr
    rows = contact(out)
    assert rows["s"][-1] == pytest.approx(1.0)
    assert np.all(np.diff(rows["x"]) > 0)
    assert np.allclose(rows["sigma_n"], -Q, rtol=1e-8)


_SPLIT = """
for name, at in (("first", 0.0), ("second", 0.5)):
    found = gmsh.model.getEntitiesInBoundingBox(at - 1e-6, -1e-6, -1e-6, at + 0.5 + 1e-6, 1e-6, 1e-6, 1)
    gmsh.model.addPhysicalGroup(1, [tag for _, tag in found], name=name)
whole = [t for _, t in gmsh.model.getPhysicalGroups(1) if gmsh.model.getPhysicalName(1, t) == "bottom"]
gmsh.model.removePhysicalGroups([(1, t) for t in whole])
"""
