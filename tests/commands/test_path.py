"""`hvi path`: strength against closed forms, the files of the contract, resume after interruptions and kills."""

from __future__ import annotations

import csv
import json
import random
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from runs import ROOT, command, hvi

from hvi_fenicsx import prepare, read_scene
from hvi_fenicsx.errors import Interrupted
from hvi_fenicsx.load_paths import path_files
from hvi_fenicsx.load_paths.following import PathRun
from hvi_fenicsx.model import PathTable
from hvi_fenicsx.paths.load_path import LoadPath
from hvi_fenicsx.runtime.writing import Record

BAR = ROOT / "demos" / "glued_bar.toml"
SHORT = ("--set", "domain.size=[0.05, 0.001]", "--set", "domain.cells=[50, 1]")
COLUMNS = "row,factor,event,part,x,y,z,energy,work,dissipated,stable,pull.fx,pull.fy,pull.ux,pull.uy"
KEYS = {"rows", "events", "peak_factor", "peak_row", "folds", "jumps", "work", "dissipated", "end", "certified"}


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "path.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def summary(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return found


def test_the_strength_of_a_short_glued_bar_and_what_the_folder_holds(tmp_path: Path) -> None:
    """Yuan and Teng's closed form: 215.771 N/mm."""
    out = tmp_path / "bar"
    done = hvi("path", BAR, "--out", out, *SHORT)
    assert done.returncode == 0, done.stderr
    assert "largest factor that is borne: 1.07" in done.stdout
    assert "then the body comes off" in done.stdout
    found = summary(out)["path"]
    assert found.keys() >= KEYS | {"uncertified"}
    assert found["end"] == "escapes"
    assert found["uncertified"] == 0
    assert found["certified"] == found["rows"] == len(rows(out))
    assert found["peak_forces"]["pull"]["force"][0] == pytest.approx(215.771e3, rel=1e-3)
    assert (out / "path.csv").read_text(encoding="utf-8").splitlines()[0] == COLUMNS
    assert rows(out)[0]["event"] == "start"
    assert {f.name for f in out.iterdir()} >= {"path.png", "displacement.pvd", "scene.toml", "run.log", "report.html"}
    assert path_files.JOURNAL not in {f.name for f in out.iterdir()}
    refused = hvi("path", BAR, "--out", out, *SHORT)
    assert refused.returncode == 2
    assert "already holds a path" in refused.stderr
    assert "finished already" in hvi("path", BAR, "--out", out, *SHORT, "--resume").stdout


def follow(run: PathRun, stop: int | None = None, known: list[Record] | None = None) -> tuple[LoadPath, list[Record]]:
    kept: list[Record] = list(known or [])
    return run.follow(known or [], kept.append, lambda: stop is not None and len(kept) >= stop), kept


def test_a_path_that_is_interrupted_while_its_body_is_condensed_ends_there() -> None:
    with pytest.raises(Interrupted):
        PathRun(prepare(read_scene(BAR, ["domain.cells=[25, 1]"])), PathTable(), lambda: True)


def test_a_path_that_is_interrupted_goes_on_to_the_same_end_with_energies_in_balance() -> None:
    """Loaded, unloaded and loaded again, with memory."""
    scene = read_scene(BAR, ["domain.size=[0.05, 0.001]", "domain.cells=[25, 1]", "path.to=[1.0, 0.3, 1.05]"])
    prepared, wanted = prepare(scene), scene.path or PathTable()
    whole, every = follow(PathRun(prepared, wanted))
    assert whole.converged
    ended, _ = follow(PathRun(prepared, wanted), None, every)  # killed after its last row
    assert (ended.end, [row.event for row in ended.rows]) == (whole.end, [row.event for row in whole.rows])
    assert whole.examined == len(whole.rows)
    assert [row.event for row in whole.rows].count("turn") == 2
    for stop in (1, 9, len(whole.rows) - 2):
        first, kept = follow(PathRun(prepared, wanted), stop)
        assert first.end == "interrupted"
        assert len(kept) < len(whole.rows)
        again, _ = follow(PathRun(prepared, wanted), None, kept)
        assert [(r.event, r.part) for r in again.rows] == [(r.event, r.part) for r in whole.rows]
        for one, other in zip(again.rows, whole.rows, strict=True):
            np.testing.assert_allclose(
                [one.factor, one.work, one.dissipated, *one.displacements["pull"]],
                [other.factor, other.work, other.dissipated, *other.displacements["pull"]],
                rtol=1e-9,
                atol=1e-12,
            )
    force = np.array([row.forces["pull"][0] for row in whole.rows])
    moved = np.array([row.displacements["pull"][0] for row in whole.rows])
    work = np.concatenate([[0.0], np.cumsum(0.5 * (force[1:] + force[:-1]) * np.diff(moved))])
    np.testing.assert_allclose([row.work for row in whole.rows], work, atol=1e-8 * work[-1])
    dissipated = np.array([row.dissipated for row in whole.rows])
    assert np.all(np.diff(dissipated) >= -1e-9 * dissipated[-1])
    stored = np.array([row.energy for row in whole.rows]) + force * moved
    np.testing.assert_allclose(stored + dissipated, work, atol=1e-8 * work[-1])


def test_a_path_without_any_state_is_written_and_said(tmp_path: Path) -> None:
    """The floor's law pushes from the first slip on: nothing holds the body even without a load."""
    law = "{ law = 'graph', points = [[0.0, 0.0], [1e-6, -1e3]] }"
    scene = tmp_path / "pushed.toml"
    scene.write_text(f"""
        domain = {{ shape = "rectangle", size = [1.0, 1.0], cells = [2, 2] }}
        material = {{ model = "plane_stress", youngs_modulus = 2.15e11, poisson_ratio = 0.29 }}
        boundary.press = {{ on = "top", traction = [0.0, -1e6] }}
        boundary.floor = {{ on = "bottom", contact = {{ gap = 0.0 }}, friction = {law} }}
    """)
    done = hvi("path", scene, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "no state is borne: nothing holds the body at rest" in done.stdout
    assert summary(tmp_path / "out")["path"]["rows"] == 0


@pytest.mark.long
@pytest.mark.parametrize("follow_how", ["stable", "exact"])
def test_the_strength_of_the_glued_bar(follow_how: str, tmp_path: Path) -> None:
    """Yuan and Teng's closed form: 220.591 N/mm; exactly, the path goes on to the last bond and dissipates all."""
    done = hvi("path", BAR, "--out", tmp_path / "bar", "--set", f'path.follow="{follow_how}"')
    assert done.returncode == 0, done.stderr
    found = summary(tmp_path / "bar")["path"]
    assert found["peak_forces"]["pull"]["force"][0] == pytest.approx(220.591e3, rel=1e-3)
    if follow_how == "exact":
        assert found["dissipated"] == pytest.approx(0.5 * 7.2e6 * 1.6e-4 * 0.19, rel=1e-9)


STRAIGHT = (BAR, *SHORT, "--set", "path.to=[1.0, 0.3, 1.05]")
SOFT = "boundary.base.adhesion.points=[[0,0],[5e-6,1e6],[1e-4,0]]"
CURVED = (
    *(ROOT / "demos" / "anchor_3d.toml", "--set", "domain.cells=[3,3,2]", "--set", SOFT),
    *("--set", "path.to=[1.3,0.1,1.4]"),
)


@pytest.mark.long
@pytest.mark.parametrize("ranks", [2, 3])
@pytest.mark.parametrize("words", [STRAIGHT, CURVED], ids=["straight", "curved"])
def test_several_ranks_give_the_same_rows(words: tuple[object, ...], ranks: int, tmp_path: Path) -> None:
    assert hvi("path", *words, "--no-pictures", "--out", tmp_path / "one").returncode == 0
    done = hvi("path", *words, "--no-pictures", "--out", tmp_path / "many", ranks=ranks)
    assert done.returncode == 0, done.stderr
    one, many = (marked(rows(tmp_path / name)) for name in ("one", "many"))
    assert [r["event"] for r in one] == [r["event"] for r in many]
    force, moved = ("pull.fz", "pull.uz") if "pull.fz" in one[0] else ("pull.fx", "pull.ux")
    for name in ("factor", "energy", "work", "dissipated", force, moved):
        values = [np.array([float(r[name]) for r in table]) for table in (one, many)]
        np.testing.assert_allclose(values[1], values[0], rtol=1e-8, atol=1e-9 * np.max(np.abs(values[0])))


def marked(table: list[dict[str, str]]) -> list[dict[str, str]]:
    """The rows but those where a curve is only sampled, which need not agree."""
    return [row for row in table if row["event"] != "step"]


KILLED = ("path", BAR, *SHORT, "--set", "path.to=[1.0, 0.3, 1.05]", "--no-pictures")


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[dict[str, str]], float]:
    """The rows of a path that nobody kills, and how long it takes, s."""
    out, start = tmp_path_factory.mktemp("whole") / "bar", time.monotonic()
    subprocess.run(command(*KILLED, "--out", out), cwd=ROOT, check=True, capture_output=True)
    return rows(out), time.monotonic() - start


@pytest.mark.long
@pytest.mark.parametrize("seed", range(6))
def test_a_killed_path_is_resumed_to_the_same_rows(
    seed: int, whole: tuple[list[dict[str, str]], float], tmp_path: Path
) -> None:
    """Half of them are killed while the path is followed, the others at any time from the start on."""
    wanted, duration = whole
    chance, out = random.Random(seed), tmp_path / "bar"
    process = subprocess.Popen(
        command(*KILLED, "--out", out), cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    if seed % 2:
        time.sleep(chance.uniform(0.0, duration))
    else:
        wait_for(process, out / path_files.JOURNAL, chance.randrange(200, 20_000))
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = hvi(*KILLED, "--out", out, "--resume")
    assert done.returncode == 0, done.stderr
    found = rows(out)
    assert [r["event"] for r in found] == [r["event"] for r in wanted]
    for name in ("factor", "work", "pull.ux"):
        np.testing.assert_allclose(
            [float(r[name]) for r in found], [float(r[name]) for r in wanted], rtol=1e-9, atol=1e-15
        )


def wait_for(process: subprocess.Popen[bytes], file: Path, size: int) -> None:
    """Until a file has a size, or the process ends."""
    while process.poll() is None and not (file.exists() and file.stat().st_size > size):
        time.sleep(0.002)
