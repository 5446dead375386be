"""hvi.study on models: the axes that suit a model, the errors of its points, the folder of the command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import ufl
from own_mesh import own_square, steel_square

import hvi_fenicsx as hvi
from hvi_fenicsx.study.conduct import NoReferenceError

COARSE = 4


@pytest.fixture(scope="module")
def body() -> hvi.Body:
    return own_square(cells=COARSE)


def with_ufl(body: hvi.Body) -> hvi.Model:
    x = ufl.SpatialCoordinate(body.mesh)
    return steel_square(body=body, press=[0.0, -1e6 * (1 + x[0])])


@pytest.mark.long
def test_meshes_of_a_model_are_refinements_of_its_body(body: hvi.Body) -> None:
    """Loads by Python functions are known on all of them; the errors are those against the refined solution."""
    model = steel_square(body=body, press=[0.0, lambda x: -1e6 * (1 + x[0])])
    found = hvi.study(model, mesh=[0, 1], epsilon=["exact", 0.1], repeats=1)
    by_name = {row.text: row for row in found.rows}
    own, fine = by_name["given mesh, as it is, exact law"], by_name["given mesh, refined once, exact law"]
    assert own.energy == pytest.approx(hvi.solve(model).energy, rel=1e-10)
    smoothed = by_name["given mesh, as it is, ε = 0.1"]
    assert smoothed.energy == pytest.approx(hvi.solve(model, epsilon=0.1).energy, rel=1e-10)
    errors = [row.error("energy_norm") for row in (own, fine)]
    assert errors[0] is not None
    assert errors[1] is not None
    assert 1.4 < errors[0] / errors[1] < 2.6  # of first order in h


def test_a_study_without_a_reference_says_so_by_its_own_error(body: hvi.Body) -> None:
    lifted = steel_square(body=body).replace(hvi.Traction("press", [0.0, 1e6]))
    with pytest.raises(NoReferenceError, match="no solution exists"):
        hvi.study(lifted, tolerance=[1e-4], repeats=1)


@pytest.mark.long
def test_data_on_the_mesh_leave_the_model_that_mesh(body: hvi.Body, tmp_path: Path) -> None:
    model = with_ufl(body)
    with pytest.raises(hvi.InputError, match=r"--axis mesh: .*no other mesh"):
        hvi.study(model, mesh=[0, 1])
    found = hvi.study(model, tmp_path / "kept", tolerance=[1e-4], repeats=1)
    assert {row.mesh for row in found.rows} == {"the body's mesh"}
    kept = json.loads((tmp_path / "kept" / "study.json").read_text(encoding="utf-8"))
    assert tuple(kept["sentences"]) == found.sentences
    with pytest.raises(hvi.InputError, match="already holds a study"):
        hvi.study(model, tmp_path / "kept")


@pytest.mark.parametrize(
    ("axes", "reason"),
    [
        ({"mash": [1]}, 'unknown axis "mash"; did you mean "mesh"'),
        ({"epsilon": 0.1}, "epsilon is 0.1; give a list"),
        ({"epsilon": [-1]}, "must be greater than 0"),
        ({"mesh": ["fine"]}, "is no number of refinements"),
    ],
)
def test_what_is_no_axis_of_a_model_is_refused(body: hvi.Body, axes: Any, reason: str) -> None:
    with pytest.raises(hvi.InputError, match=reason):
        hvi.study(steel_square(body=body), **axes)


@pytest.mark.long
def test_a_scene_has_the_errors_of_the_command(tmp_path: Path) -> None:
    from runs import ROOT, process

    scene = ROOT / "demos" / "strong_law.toml"
    words = ["--set", "domain.cells=[8, 8]", "--axis", "mesh=8,16", "--repeat", 1, "--out", tmp_path / "study"]
    assert process("study", scene, *words).returncode == 0
    told = json.loads((tmp_path / "study" / "study.json").read_text(encoding="utf-8"))["points"]
    found = hvi.study(hvi.read_scene(scene, ["domain.cells=[8, 8]"]), mesh=[8, 16], repeats=1)
    assert [row.point for row in found.rows] == [row["point"] for row in told]
    for row, other in zip(found.rows, told, strict=True):
        assert row.errors == pytest.approx(other["errors"], rel=1e-9)
