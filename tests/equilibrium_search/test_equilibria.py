"""`hvi equilibria` and `hvi.equilibria`: files, exit codes, stop and resume, against brute force."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import pytest
import tomli_w
from enumeration import Floor, polyline
from matplotlib.colors import to_rgb
from PIL import Image
from scenes import DELTA, Table, model, quadratic_linear

import hvi_fenicsx as hvi
from hvi_fenicsx.commands import equilibria as command
from hvi_fenicsx.commands.cli import main
from hvi_fenicsx.equilibrium_search.search import Saved
from hvi_fenicsx.report.pictures.style import BLUE, ORANGE, PALE, VERMILION

GAMMA = 3e6
STRONG = quadratic_linear(GAMMA)


def written(folder: Path, **more: object) -> Path:
    path = folder / "scene.toml"
    path.write_text(tomli_w.dumps({"title": "three equilibria", **model(3, 6e6, friction=STRONG), **more}))
    return path


def energies() -> list[float]:
    law = polyline([(0.0, 0.0), (DELTA, GAMMA), (DELTA, GAMMA / 2)])
    return [p.energy for p in Floor(3, 6e6, 1e6, law).stationary()]


def test_python_finds_all_certified_and_proves_the_lowest() -> None:
    scene = hvi.read_tables(model(3, 6e6, friction=STRONG))
    found = hvi.equilibria(scene)
    assert found.complete
    assert found.kinds == ("minimiser", "minimiser", "saddle")
    assert [s.energy for s in found.solutions] == pytest.approx(energies(), rel=1e-9)
    assert all(s.converged for s in found.solutions)
    lowest = hvi.equilibria(scene, lowest=True)
    assert lowest.proven
    assert lowest.lower_bound is not None
    assert energies()[0] * (1 + 2e-8) <= lowest.lower_bound <= energies()[0]
    assert lowest.gap is not None
    assert lowest.gap <= 1e-8


def test_the_command_writes_each_equilibrium_and_refuses_what_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["equilibria", str(written(tmp_path)), "--out", str(out), "--no-pictures"]
    assert main(words) == 0
    with (out / "equilibria.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["index", "energy", "kind", "max_slip", "max_opening", "broken", "folder"]
    assert [float(r["energy"]) for r in rows] == pytest.approx(energies(), rel=1e-9)
    for row in rows:
        own = json.loads((out / row["folder"] / "summary.json").read_text())
        assert own["certificate"]["passed"]
        assert own["energy"] == pytest.approx(float(row["energy"]), rel=1e-12)
    known = json.loads((out / "summary.json").read_text())["equilibria"]
    assert (known["count"], known["complete"], known["proven"]) == (3, True, True)
    saddle = energies()[2]
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "All equilibria, proven: 3." in page
    assert f"{saddle:.10g}".replace("-", "\N{MINUS SIGN}") in page
    assert b"\r" not in (out / "equilibria.csv").read_bytes()
    assert main(words) == 2
    capsys.readouterr()
    assert main([*words, "--resume"]) == 0
    assert capsys.readouterr().out == f"{out}: finished already (all equilibria, proven: 3)\n"
    before = {file: file.read_bytes() for file in sorted(out.rglob("*")) if file.is_file()}
    for other in (["run", *words[1:]], ["path", *words[1:]], [*words, "--set", "title='another'"]):
        assert main([*other, "--resume"]) == 2  # a search is replaced by --force alone
    assert {file: file.read_bytes() for file in sorted(out.rglob("*")) if file.is_file()} == before


def test_the_lowest_equilibrium_is_certified_where_a_descent_ends_slowly() -> None:
    """Laws that fall nearly as steeply as the body is stiff: each step of a descent leaves a share of the rest."""
    law = {"law": "graph", "points": [[0, 0], [3.691e-4, 8.963e7], [2.889e-3, 3.702e7]]}
    table = model(3, 3.333e8, 2.218e8, friction=law, gap=6.904e-4)
    table["domain"] = {"shape": "rectangle", "size": [1.0, 0.272], "cells": [3, 2]}
    table["material"] = {"model": "plane_strain", "youngs_modulus": 4.507e10, "poisson_ratio": 0.0}
    found = hvi.equilibria(hvi.read_tables(table), lowest=True)
    assert found.proven
    assert found.solutions[0].converged


class Killed(BaseException):
    """Stands for SIGKILL, after which nothing is tidied up."""


TEETH = {"law": "graph", "points": [[0, 0], *([d, t] for d in (4e-6, 9e-6, 1.4e-5, 2e-5) for t in (2e6, 8e5))]}


@pytest.mark.parametrize(
    ("words", "table"),
    [((), model(8, 6e6, friction=STRONG)), (("--lowest",), model(32, 5e6, friction=TEETH))],
    ids=["all", "lowest"],
)
def test_a_search_that_is_killed_goes_on_from_its_last_state(
    words: tuple[str, ...], table: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After some boxes the process dies; the next one needs fewer boxes than a whole search, and finds the same."""
    run = ["equilibria", str(written(tmp_path, **table)), "--no-pictures", *words]
    assert main([*run, "--out", str(tmp_path / "whole")]) == 0
    whole = json.loads((tmp_path / "whole" / "summary.json").read_text())["equilibria"]
    assert whole["nodes"] > 4
    kept = command._StateFile.keep
    states: list[int] = []

    def keep(file: command._StateFile, state: Callable[[], Saved]) -> None:
        kept(file, state)
        states.append(1)
        if 4 * len(states) >= whole["nodes"] - 4:
            raise Killed

    out, mine = tmp_path / "out", tmp_path / "out" / "mine.txt"
    with monkeypatch.context() as patched:
        patched.setattr(command, "KEPT_EVERY", 0)
        patched.setattr(command._StateFile, "keep", keep)
        with pytest.raises(Killed):
            main([*run, "--out", str(out)])
    mine.write_text("precious")
    assert main([*run, "--out", str(out)]) == 2
    assert main([*run, "--out", str(out), "--resume"]) == 0
    found = json.loads((out / "summary.json").read_text())["equilibria"]
    assert found["proven"]
    assert found["nodes"] < whole["nodes"]
    assert found["lowest_energy"] == pytest.approx(whole["lowest_energy"], rel=1e-9)
    assert found["count"] == whole["count"]
    assert mine.read_text() == "precious"
    assert not (out / "search.journal").exists()


@pytest.mark.long
def test_a_search_that_is_stopped_goes_on_where_it_was(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ["equilibria", str(written(tmp_path)), "--out", str(out), "--no-pictures"]
    assert main([*words, "--limit", "1e-9"]) == 4
    assert (out / "search.journal").exists()
    assert main([*words, "--resume"]) == 0
    assert json.loads((out / "summary.json").read_text())["equilibria"]["count"] == 3
    assert not (out / "search.journal").exists()


@pytest.mark.long
def test_the_picture_has_a_strip_for_each_equilibrium_and_lines_to_the_saddle(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["equilibria", str(written(tmp_path)), "--out", str(out)]) == 0
    with Image.open(out / "equilibria.png") as picture:
        assert picture.width == 1200
        colours = {c for _, c in picture.convert("RGB").getcolors(1_000_000) or []}
    assert {to_rgb(c) for c in (BLUE, ORANGE, VERMILION, PALE)} <= {tuple(v / 255 for v in c) for c in colours}


@pytest.mark.parametrize("words", [(), ("--lowest",)])
def test_without_contact_and_laws_there_is_one_equilibrium(words: tuple[str, ...], tmp_path: Path) -> None:
    """The square of the model problem, held below: u2 = -(Q + ν P)/E y, energy -6 J/m in closed form."""
    table = model(2)
    table["boundary"]["floor"] = {"on": "bottom", "displacement": ["free", 0.0]}
    out = tmp_path / "out"
    assert main(["equilibria", str(written(tmp_path, **table)), "--out", str(out), "--no-pictures", *words]) == 0
    found = json.loads((out / "summary.json").read_text())["equilibria"]
    assert (found["count"], found["proven"]) == (1, True)
    assert found["lowest_energy"] == pytest.approx(-6.0, rel=1e-9)
    assert found["lower_bound"] == pytest.approx(-6.0, rel=1e-9)
