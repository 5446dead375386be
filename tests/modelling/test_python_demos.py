"""The Python demos and the notebook run, and find what statics and closed forms say."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from demos_on_ranks import fibres, loop, plate
from runs import ROOT, on_ranks

import hvi_fenicsx as hvi

DEMOS = ROOT / "demos"
ON_RANKS = Path(__file__).parents[1] / "support" / "demos_on_ranks.py"


def demo(name: str) -> dict[str, Any]:
    return runpy.run_path(str(DEMOS / f"{name}.py"))


def test_the_plate_of_an_own_mesh_breaks_at_its_right_end(tmp_path: Path) -> None:
    found = demo("own_mesh")["main"](tmp_path)
    floor = found.contact["floor"]
    broken = floor.branch == 1
    assert np.all(floor.slip[broken] > 5e-6)
    assert np.all(np.diff(broken.astype(int)) >= 0)  # nothing has broken left of what has
    np.testing.assert_allclose(floor.friction[broken], 2e5, rtol=1e-6)
    assert {file.name for file in tmp_path.iterdir()} == {"plate.png", "floor.png"}


def test_the_force_of_the_load_loop_ends_at_the_weakened_friction(tmp_path: Path) -> None:
    force = demo("load_loop")["main"](tmp_path)
    assert force.argmax() == np.flatnonzero(np.diff(force) > 1.0).max() + 1  # N/m: rises to one peak
    assert 5e5 < force.max() < 1e6  # the floor breaks one part after the other
    assert (tmp_path / "force.png").exists()


@pytest.mark.long
def test_the_fibre_composite_has_the_compliance_of_its_constants(tmp_path: Path) -> None:
    """Without friction the stress is uniform, and the strain follows from the tensor's inverse."""
    block = demo("fibres_3d")
    a, across, one = block["FIBRES"], block["ACROSS"], np.eye(3)
    shear = block["MU_L"] - block["MU_T"]
    terms = [
        (block["LAMBDA"], "ij,kl", (one, one)),
        *((block["MU_T"], pair, (one, one)) for pair in ("ik,jl", "il,jk")),
        *((block["ALPHA"], where, (a, a, one)) for where in ("i,j,kl", "k,l,ij")),
        (block["BETA"], "i,j,k,l", (a, a, a, a)),
        *((shear, where, (a, a, one)) for where in ("i,k,jl", "i,l,jk", "j,k,il", "j,l,ik")),
    ]
    stiffness = sum(factor * np.einsum(f"{indices}->ijkl", *tensors) for factor, indices, tensors in terms)
    press = np.zeros((3, 3))
    press[2, 2] = -block["PRESS"]
    strain = (np.linalg.pinv(stiffness.reshape(9, 9)) @ press.ravel()).reshape(3, 3)
    free = hvi.solve(block["block"](), estimate=False)
    for way in (a, across):
        assert block["spread"](free, way) == pytest.approx(way @ strain @ way, rel=1e-9)
    _, held = block["main"](tmp_path)
    assert 0.0 < held[1] < across @ strain @ across  # friction hinders the spread


@pytest.mark.long
@pytest.mark.parametrize("name", ["own_mesh", "load_loop", "fibres_3d"])
def test_two_ranks_find_what_one_finds(name: str, tmp_path: Path) -> None:
    alone, told = {"fibres_3d": fibres, "load_loop": loop, "own_mesh": plate}[name](), on_ranks(2, str(ON_RANKS), name)
    np.testing.assert_allclose(told, [alone, alone], rtol=1e-6)


def test_the_notebook_runs() -> None:
    cells = json.loads((DEMOS / "first_steps.ipynb").read_text(encoding="utf-8"))["cells"]
    names: dict[str, Any] = {}
    with mpl.rc_context({"backend": "Agg"}):
        for number, cell in enumerate(c for c in cells if c["cell_type"] == "code"):
            assert not cell["outputs"]
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), names)
    weight, traction = names["floor"].weight, names["floor"].friction
    assert names["last"].resultant("bottom")[0] == pytest.approx(-weight @ traction, rel=1e-9)
    assert names["broken_length"] == sorted(names["broken_length"])
    assert names["elastic"] > 0.0
