"""What scripts rely on (docs/results.md): files, keys, columns, exit codes, results that are whole or absent.

Every file is read again by a reader of another make: VTK, NumPy, tomllib, json.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from runs import command, contact, hvi, process, summary, write_scene
from scenes import block, model, quadratic_linear

from hvi_fenicsx import read_scene

LAW = quadratic_linear(1.0e3)
COLUMNS = "part,s,x,y,z,u_n,u_t1,u_t2,gap,sigma_n,friction_t1,friction_t2,contact,branch_t,branch_n"
SUMMARY = {
    "scene": str,
    "dofs": int,
    "ranks": int,
    "converged": bool,
    "reason": str,
    "method": str,
    "smoothing": (str, type(None)),
    "epsilon": (float, type(None)),
    "iterations": ["newton", "linear", "levels", "branch"],
    "energy": float,
    "contact": ["vertices", "active", "max_gap", "max_penetration", "resultant"],
    "solvability": ["state", "margin", "lambda_held", "lambda_peak", "direction", "kernel", "paper"],
    "certificate": [
        *("equilibrium", "net_force", "penetration", "tension", "complementarity", "inclusion"),
        *("inclusion_true", "second_order", "tolerance", "passed"),
    ],
    "uniqueness": ["state", "why"],
    "estimate": (dict, type(None)),
    "warnings": list,
    "effects": list,
    "time": ["jit", "mesh", "assembly", "setup", "solve", "certificate", "output", "total"],
    "peak_memory_mb": float,
    "versions": dict,
}


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    return write_scene(tmp_path / "square.toml", model(4, friction=LAW))


@pytest.fixture(scope="module", params=[1, 2])
def result(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result folder, serial and of two ranks."""
    folder = tmp_path_factory.mktemp("result")
    path = write_scene(folder / "square.toml", {"title": "Square"} | model(8, 6e6, 1e6, quadratic_linear(3e6)))
    done = process("run", path, cwd=folder, ranks=request.param)
    assert done.returncode == 0, done.stderr
    (folder / "told.txt").write_text(done.stdout, encoding="utf-8")
    return folder / "results" / "square"


def test_the_folder_holds_what_is_promised_and_nothing_else(result: Path) -> None:
    names = {file.name for file in result.iterdir()}
    assert {"summary.json", "contact.csv", "displacement.pvd", "contact.pvd", "scene.toml", "run.log"} <= names
    assert {"boundary.csv", "report.html", "solution.npz"} <= names
    rest = {Path(n).suffix for n in names} - {".json", ".csv", ".pvd", ".toml", ".log", ".png", ".vtu", ".pvtu"}
    assert rest == {".html", ".npz"}
    assert [file.name for file in result.parent.iterdir()] == ["square"]


def test_the_summary_has_every_key_of_the_contract(result: Path) -> None:
    record = summary(result)
    for key, kind in SUMMARY.items():
        if isinstance(kind, list):
            assert set(kind) <= set(record[key]), key
        else:
            assert isinstance(record[key], kind), key
    assert set(record["solvability"]["paper"]) == {"c", "satisfied"}
    assert record["versions"].keys() >= {"dolfinx", "hvi_fenicsx"}


def test_the_summary_tells_the_truth_about_this_scene(result: Path) -> None:
    record = summary(result)
    assert (record["scene"], record["dofs"], record["converged"]) == ("Square", 162, True)
    assert record["smoothing"] is record["epsilon"] is record["solvability"]["lambda_held"] is None
    assert record["solvability"]["kernel"] == ["translation along y"]
    assert record["contact"]["vertices"] == 9
    assert record["contact"]["resultant"] == pytest.approx([0.0, 1.0e6], rel=1e-8, abs=1.0)
    phases = {k: v for k, v in record["time"].items() if k != "total"}
    assert all(v >= 0 for v in phases.values())
    assert sum(phases.values()) <= 1.05 * record["time"]["total"]


def test_the_table_has_the_columns_in_order_and_the_floor_along_its_length(result: Path) -> None:
    assert (result / "contact.csv").read_text(encoding="utf-8").splitlines()[0] == COLUMNS
    table = contact(result)
    assert set(table["part"]) == {"floor"}
    np.testing.assert_allclose(table["s"], np.linspace(0, 1, 9), atol=1e-12)
    np.testing.assert_allclose(table["x"], table["s"], atol=1e-12)
    assert not np.any(table["y"])
    for absent in ("z", "u_t2", "friction_t2", "branch_n"):
        assert np.all(np.isnan(table[absent]))


def test_the_table_obeys_signorini_and_the_law(result: Path) -> None:
    """The signs of docs/results.md: u_n outward, gap the current one, compression negative, friction_t = -σ_t."""
    table = contact(result)
    closed = table["contact"] == 1
    assert closed.any()
    assert not closed.all()  # this law lifts the floor near the wall
    np.testing.assert_allclose(table["gap"], -table["u_n"], atol=1e-20)
    assert np.all(table["gap"][closed] == pytest.approx(0.0, abs=1e-15))
    assert np.all(table["gap"][~closed] > 1e-9)
    assert np.all(table["sigma_n"][closed] < 0)
    assert np.all(np.abs(table["sigma_n"][~closed]) < 1.0)
    rising = np.abs(table["u_t1"]) < 9e-6
    wanted = np.where(rising, table["u_t1"] / 9e-6 * 3e6, 1.5e6 * np.sign(table["u_t1"]))
    np.testing.assert_allclose(table["friction_t1"], wanted, atol=1e-1)
    assert np.array_equal(table["branch_t"], np.where(rising, 0, 1))
    assert np.sum(_trapezoid(table) * table["sigma_n"]) == pytest.approx(-1e6, rel=1e-9)


def _trapezoid(table: Any) -> Any:
    steps = np.diff(table["s"])
    return (np.append(steps, 0) + np.append(0, steps)) / 2


def test_paraview_files_open_and_hold_their_arrays(result: Path) -> None:
    """One point a vertex (a shared one once on each rank), and the same numbers as the table's."""
    pyvista = pytest.importorskip("pyvista")
    ranks = summary(result)["ranks"]
    body, floor = (pyvista.get_reader(result / f"{n}.pvd").read()[0] for n in ("displacement", "contact"))
    assert len(np.unique(np.round(body.points, 9), axis=0)) == 81
    assert len(np.unique(np.round(floor.points, 9), axis=0)) == 9
    assert body.n_points == 81 or ranks > 1
    assert body["displacement"].shape == (body.n_points, 3)
    assert {"u_n", "u_t1", "sigma_n", "friction_t1", "gap", "contact"} <= set(floor.array_names)
    np.testing.assert_allclose(floor["normal"], np.tile([0.0, -1.0, 0.0], (floor.n_points, 1)), atol=1e-15)
    np.testing.assert_allclose(floor["t1"], np.tile([1.0, 0.0, 0.0], (floor.n_points, 1)), atol=1e-15)
    table = contact(result)
    at = np.rint(floor.points[:, 0] * 8).astype(int)
    for name in ("u_t1", "sigma_n", "friction_t1", "gap"):
        np.testing.assert_allclose(floor[name], table[name][at], rtol=1e-12, atol=1e-12 * np.max(np.abs(table[name])))


def test_the_resolved_scene_is_the_scene_and_runs_to_the_same_result(result: Path, tmp_path: Path) -> None:
    data = tomllib.loads((result / "scene.toml").read_text(encoding="utf-8"))
    assert data["solver"]["tolerance"] == 1e-8  # defaults are written out
    assert read_scene(result / "scene.toml") == read_scene(result.parent.parent / "square.toml")
    assert hvi("run", result / "scene.toml", "--out", tmp_path / "again", "--no-pictures").returncode == 0
    assert summary(tmp_path / "again")["energy"] == pytest.approx(summary(result)["energy"], rel=1e-10)


def test_the_log_tells_every_newton_step_and_what_the_terminal_told(result: Path) -> None:
    log = (result / "run.log").read_text(encoding="utf-8")
    assert "residual" in log
    assert "certificate" in log
    assert "existence: held" in log


def test_a_result_is_refused_kept_or_replaced_as_asked(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "r"
    run = ["run", scene, "--out", out, "--no-pictures"]
    assert hvi(*run).returncode == 0
    first = (out / "summary.json").stat().st_mtime_ns
    refused = hvi(*run)
    assert (refused.returncode, refused.stdout) == (2, "")
    assert "--force" in refused.stderr
    assert hvi(*run, "--resume").returncode == 0
    assert (out / "summary.json").stat().st_mtime_ns == first
    assert hvi(*run, "--resume", "--set", "domain.cells=[3, 3]").returncode == 0
    assert summary(out)["dofs"] == 32
    assert hvi(*run, "--force").returncode == 0
    assert summary(out)["dofs"] == 50


def test_force_does_not_touch_a_folder_that_holds_other_things(scene: Path, tmp_path: Path) -> None:
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.tex").write_text("years of work")
    done = hvi("run", scene, "--out", tmp_path / "home", "--force")
    assert done.returncode == 2
    assert (tmp_path / "home" / "thesis.tex").read_text() == "years of work"


def test_a_refused_scene_leaves_the_old_result_alone(scene: Path, tmp_path: Path) -> None:
    run = ["run", scene, "--out", tmp_path / "r", "--no-pictures"]
    assert hvi(*run).returncode == 0
    before = {f.name: f.stat().st_mtime_ns for f in (tmp_path / "r").iterdir()}
    done = hvi(*run, "--force", "--set", 'boundary.floor.contact.gap="sqrt(x - 2)"')
    assert done.returncode == 2
    assert {f.name: f.stat().st_mtime_ns for f in (tmp_path / "r").iterdir()} == before
    assert sorted(f.name for f in tmp_path.iterdir()) == ["r", "square.toml"]


LARGE = ["--set", "domain.cells=[200, 200]", "--set", 'solver.linear_solver="gamg"', "--no-pictures"]


def started(scene: Path, out: Path, *further: str) -> subprocess.Popen[str]:
    """A run that is about to solve: it has told whether a solution exists."""
    words = command("run", scene, "--out", out, *LARGE, *further)
    child = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert child.stdout is not None
    while (line := child.stdout.readline()) and not line.startswith("existence"):
        pass
    assert line.startswith("existence")
    return child


def test_a_killed_run_leaves_no_result_and_the_next_one_works(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "r"
    child = started(scene, out)
    os.killpg(child.pid, signal.SIGKILL)
    child.wait()
    child.communicate()
    assert not out.exists()
    assert hvi("run", scene, "--out", out, "--no-pictures").returncode == 0
    assert sorted(f.name for f in tmp_path.iterdir()) == ["r", "square.toml"]


@pytest.mark.parametrize(
    ("number", "ranks"),
    [
        (signal.SIGINT, ()),
        pytest.param(signal.SIGTERM, (), marks=pytest.mark.long),
        (signal.SIGINT, ("--np", "2")),
        pytest.param(signal.SIGTERM, ("--np", "2"), marks=pytest.mark.long),  # passed on by the same few lines
    ],
)
def test_an_interrupted_run_writes_what_it_has_and_says_so(
    number: int, ranks: tuple[str, ...], scene: Path, tmp_path: Path
) -> None:
    child = started(scene, tmp_path / "r", *ranks)
    child.send_signal(number)
    _, errors = child.communicate(timeout=120)
    assert child.returncode == 130, errors
    assert "Traceback" not in errors
    record = summary(tmp_path / "r")
    assert (record["converged"], record["exit_code"]) == (False, 130)
    assert "interrupted" in record["reason"]
    assert len(contact(tmp_path / "r")) == 201


def test_values_are_overridden_in_order_and_wrong_ones_are_named(scene: Path, tmp_path: Path) -> None:
    done = hvi(
        *("run", scene, "--out", tmp_path / "r", "--no-pictures"),
        *("--set", "domain.cells=[9, 9]", "--set", "domain.cells.1=2", "--set", "material.youngs_modulus=1e9"),
    )
    assert done.returncode == 0
    assert summary(tmp_path / "r")["dofs"] == 60
    data = tomllib.loads((tmp_path / "r" / "scene.toml").read_text(encoding="utf-8"))
    assert data["material"]["youngs_modulus"] == 1e9
    wrong = hvi("check", scene, "--set", "domain.cels=[9, 9]")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert "--set domain.cels" in wrong.stderr


def test_check_reports_in_words_and_as_json_and_writes_nothing(scene: Path, tmp_path: Path) -> None:
    words = hvi("check", scene, cwd=tmp_path)
    assert words.returncode == 0
    for piece in ("held", "translation along y", "contact", "friction", "MUMPS"):
        assert piece in words.stdout
    data = json.loads(hvi("check", scene, "--json", cwd=tmp_path).stdout)
    assert data["dofs"] == 50
    assert data["solvability"]["state"] == "held"
    assert [e["effect"] for e in data["effects"]] == [
        "isotropic",
        "displacement",
        "traction",
        "traction",
        "contact",
        "friction",
    ]
    assert [f.name for f in tmp_path.iterdir()] == ["square.toml"]


def test_what_does_not_exist_ends_with_3_and_a_direction(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "up.toml", model(4, press=-1e6, friction=LAW))
    done = hvi("run", scene, "--out", tmp_path / "r", "--no-pictures")
    assert done.returncode == 3
    assert "translation along y" in done.stdout
    record = summary(tmp_path / "r")
    assert record["solvability"]["state"] == "escapes"
    assert record["energy"] is record["certificate"] is None
    assert hvi("check", scene).returncode == 3


def test_an_equilibrium_that_is_not_found_ends_with_4_and_what_there_is(tmp_path: Path) -> None:
    scene = write_scene(tmp_path / "pushed.toml", block(3, 0.97e6, 1e6, quadratic_linear(1e6)))
    done = process("run", scene, "--out", tmp_path / "r", "--no-pictures")
    assert done.returncode == 4
    record = summary(tmp_path / "r")
    assert "no equilibrium found" in record["reason"]
    assert record["converged"] is False
    assert record["certificate"]["passed"] is False
    assert record["last_borne"]["certificate"]["passed"] is True
    borne = record["last_borne"]["factor"]
    assert record["resultants"]["pull"] == pytest.approx([borne * 0.97e6, 0.0])
    with np.load(tmp_path / "r" / "solution.npz") as arrays:
        assert np.max(np.abs(arrays["displacement"])) < 1e-4


def test_help_is_instant_and_knows_the_exit_codes() -> None:
    """Half a second of processor time, by the best of three: no dolfinx, no MPI for a help text."""
    best = np.inf
    for _ in range(3):
        start = processor_time_of_children()
        done = process("--help")
        best = min(best, processor_time_of_children() - start)
    assert done.returncode == 0
    assert "3 no solution exists" in done.stdout
    assert best < 0.5


def processor_time_of_children() -> float:
    """What all processes took that this one started, and that ended, s."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


@pytest.mark.parametrize(
    "form", [["--petsc", "-hvi_snes_view -hvi_pc_type lu"], ["--petsc=-hvi_snes_view -hvi_pc_type lu"]]
)
def test_petsc_options_reach_the_solver(form: list[str], scene: Path, tmp_path: Path) -> None:
    done = process("run", scene, "--out", tmp_path / "r", "--no-pictures", *form)
    assert done.returncode == 0, done.stderr
    assert "hvi_" in done.stdout
    assert "type: vinewtonrsls" in done.stdout
