"""The ParaView macro names only arrays that are there; where there is a pvpython, it runs."""

from __future__ import annotations

import ast
import csv
import os
import random
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI
from runs import ROOT, hvi
from scenes import two_blocks

import hvi_fenicsx

pyvista = pytest.importorskip("pyvista")
MACRO = ROOT / "docs" / "open_result.py"
RUNS = {
    "plane": (2, "demos/strong_law.toml", "domain.cells=[8, 8]"),
    "space": (3, "demos/anchor_3d.toml", "domain.cells=[2, 2, 2]"),
    "escapes": (2, "demos/pushed_block.toml", "boundary.push.traction=[1.1e6, 0]"),
}


def constants() -> dict[str, object]:
    """What the macro names, without running it: it imports ParaView."""
    tree = ast.parse(MACRO.read_text(encoding="utf-8"))
    found = [node for node in tree.body if isinstance(node, ast.Assign)]
    return {node.targets[0].id: ast.literal_eval(node.value) for node in found if isinstance(node.targets[0], ast.Name)}


@pytest.fixture(params=RUNS)
def result(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[int, Path]:
    dimension, scene, change = RUNS[request.param]
    folder = tmp_path / request.param
    hvi("run", ROOT / scene, "--set", change, "--out", folder, "--no-pictures")
    return dimension, folder


def strain_by_vtk(body: Any) -> Any:
    """The strain in each cell by VTK's own derivatives, (cells, 9)."""
    from vtkmodules.vtkFiltersGeneral import vtkCellDerivatives

    body.set_active_vectors("displacement")
    derivatives = vtkCellDerivatives()
    derivatives.SetInputData(body)
    derivatives.SetTensorModeToComputeStrain()
    derivatives.Update()
    return pyvista.wrap(derivatives.GetOutput()).cell_data["Strain"]


def test_each_array_tells_its_unit(result: tuple[int, Path]) -> None:
    from vtkmodules.vtkCommonCore import vtkDataArray

    dimension, folder = result
    wanted = {
        "displacement": "m",
        "reaction": "N/m" if dimension == 2 else "N",
        "stress": "N/m²",
        "strain": "1",
        "u_n": "m",
    }
    told = {}
    for name in ("displacement.pvd", "contact.pvd"):
        if (folder / name).exists():
            grid = pyvista.get_reader(folder / name).read()[0]
            for data in (grid.GetPointData(), grid.GetCellData()):
                arrays = (data.GetArray(i) for i in range(data.GetNumberOfArrays()))
                told |= {a.GetName(): a.GetInformation().Get(vtkDataArray.UNITS_LABEL()) for a in arrays}
    if folder.name == "escapes":
        assert told == {"escape_mode": "1"}
        return
    assert all(told.values())
    assert {name: told.get(name) for name in wanted} == wanted


def test_every_array_that_the_macro_names_is_there(result: tuple[int, Path]) -> None:
    dimension, folder = result
    named = constants()
    body = pyvista.get_reader(folder / "displacement.pvd").read()[0]
    (vector,) = [name for name in named["WARPS"] if name in body.point_data]  # type: ignore[attr-defined]
    assert body.point_data[vector].shape == (body.n_points, 3)
    assert (vector == "escape_mode") == (folder.name == "escapes")
    if vector == "escape_mode":
        return
    assert body.cell_data[named["STRESS"]].shape == (body.n_cells,)  # type: ignore[call-overload]
    np.testing.assert_allclose(body.cell_data["strain"], strain_by_vtk(body), atol=1e-6 * np.ptp(body["strain"]))
    contact = pyvista.get_reader(folder / "contact.pvd").read()[0]
    colour, _ = named["COLOURS"][dimension]  # type: ignore[index]
    assert contact.point_data[colour].shape == (contact.n_points,)
    with (folder / "contact.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    assert {"s", *named["CURVES"]} <= set(rows[0])  # type: ignore[misc]
    assert all(row["s"] for row in rows) == (dimension == 2)


@pytest.mark.long
@pytest.mark.skipif(shutil.which("pvpython") is None, reason="no ParaView here")
def test_the_macro_runs(result: tuple[int, Path], tmp_path: Path) -> None:
    picture = tmp_path / "picture.png"
    server = f"--server-num={random.randint(1000, 60000)}"  # xvfb-run's own choice of a free one is a race
    command = ["xvfb-run", server, "pvpython", str(MACRO), str(result[1]), "--picture", str(picture)]
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, env=kept)
    assert done.returncode == 0
    assert "ERR" not in done.stdout + done.stderr
    assert picture.stat().st_size > 10_000


def test_both_sides_of_an_interface_are_written(tmp_path: Path) -> None:
    """The forces on the two sides, in boundary.csv and by the tractions of contact.pvd, are opposite."""
    scene = two_blocks("rectangle", [1.0], [[9, 4], [7, 3]], "plane_stress")
    found = hvi_fenicsx.solve(hvi_fenicsx.read_tables(scene), MPI.COMM_SELF)
    found.write(tmp_path / "r")
    first, second = pyvista.get_reader(tmp_path / "r" / "contact.pvd").read()
    assert "sigma_n" in first.point_data
    assert (second.n_points, second.point_data.keys()) == (10, ["traction"])
    with (tmp_path / "r" / "boundary.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    sums = {
        part: [sum(float(row[f"reaction_{axis}"]) for row in rows if row["part"] == part) for axis in "xy"]
        for part in ("seam", "seam.second")
    }
    assert sums["seam"] == pytest.approx([-found.resultant("seam.second")[i] for i in range(2)], rel=1e-9)
    assert sums["seam.second"] == pytest.approx([-force for force in sums["seam"]], rel=1e-9)
    traction = second.point_data["traction"]
    there = ~np.isnan(traction[:, 0])
    assert 8 <= np.count_nonzero(there) <= 9  # the upper block begins at 0.21, in the second facet
    assert np.all(np.sign(traction[there].sum(axis=0)[:2]) == np.sign(sums["seam.second"]))
