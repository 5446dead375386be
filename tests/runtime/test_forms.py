"""Compiled forms are kept; no run that is killed while it compiles, and no full cache, stops a later one."""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI
from runs import ROOT, command, process, summary, write_scene
from scenes import model, quadratic_linear

from hvi_fenicsx.errors import HviError
from hvi_fenicsx.runtime.forms import FormCache


def area(power: int = 1) -> Any:
    """A small form; each power is another one."""
    square = mesh.create_unit_square(MPI.COMM_SELF, 1, 1)
    return fem.Constant(square, 3.0) ** power * ufl.dx


def value(form: fem.Form) -> float:
    return float(fem.assemble_scalar(form))


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache that holds the area alone."""
    folder = tmp_path_factory.mktemp("cache")
    assert value(FormCache(folder).compiled(area())) == pytest.approx(3.0)
    return folder


def entry(cache: Path) -> Path:
    return next(folder for folder in cache.iterdir() if folder.is_dir())


def test_parts_of_a_boundary_share_a_compiled_form_and_keep_their_own_facets(tmp_path: Path) -> None:
    """70 parts of one facet each along a square's lower side: ∫ v ds is the part's length; and two that overlap."""
    square = mesh.create_unit_square(MPI.COMM_SELF, 70, 1)
    facets = mesh.locate_entities_boundary(square, 1, lambda x: np.isclose(x[1], 0.0))
    middles = mesh.compute_midpoints(square, 1, facets)[:, 0]
    tags = mesh.meshtags(square, 1, facets, np.floor(70 * middles).astype(np.int32))
    v, ds = ufl.TestFunction(fem.functionspace(square, ("Lagrange", 1))), ufl.Measure("ds", square, subdomain_data=tags)
    cache, x = FormCache(tmp_path), square.geometry.x[:, 0]
    for part in range(70):
        found = fem.assemble_vector(cache.compiled(v * ds(part))).array
        assert found.sum() == pytest.approx(1 / 70)
        assert np.allclose(x[found != 0], np.array([part, part + 1]) / 70)
    assert len([folder for folder in tmp_path.iterdir() if folder.is_dir()]) == 1
    both = fem.assemble_vector(cache.compiled(v * ds((8, 5)) + 3.0 * v * ds((5, 31)))).array
    assert both.sum() == pytest.approx((1 + 4 + 3) / 70)
    assert both @ x == pytest.approx((8.5 + 4 * 5.5 + 3 * 31.5) / 70**2)


def test_what_a_killed_run_left_is_removed(kept: Path, tmp_path: Path) -> None:
    """A folder of the same form, with the file by which dolfinx would wait for ever."""
    left = tmp_path / f"{entry(kept).name}.building-killed"
    left.mkdir()
    (left / next(entry(kept).glob("*.c")).name).touch()
    assert value(FormCache(tmp_path).compiled(area())) == pytest.approx(3.0)
    assert not left.exists()


def test_a_damaged_form_is_compiled_again(kept: Path, tmp_path: Path) -> None:
    """As a power cut leaves it: the names are there, the content is not."""
    damaged = tmp_path / entry(kept).name
    damaged.mkdir()
    for file in entry(kept).iterdir():
        (damaged / file.name).touch()
    assert value(FormCache(tmp_path).compiled(area())) == pytest.approx(3.0)
    sizes = [file.stat().st_size for file in damaged.glob("*.so")]
    assert sizes
    assert min(sizes) > 0


def test_a_cache_that_cannot_be_written_is_replaced_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").touch()
    cache = FormCache(tmp_path / "file" / "cache")
    with caplog.at_level(logging.WARNING, logger="hvi_fenicsx"):
        assert value(cache.compiled(area())) == pytest.approx(3.0)
        assert value(cache.compiled(area(2))) == pytest.approx(9.0)
    assert [r.getMessage().partition(" (")[0] for r in caplog.records] == [
        f"compiled forms cannot be kept in {tmp_path / 'file' / 'cache'}"
    ]


def test_a_form_that_cannot_be_compiled_is_one_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "/no/such/compiler")
    with pytest.raises(HviError, match="cannot be compiled"):
        FormCache(tmp_path).compiled(area())
    assert [f.suffix for f in tmp_path.iterdir()] == [".lock"]


def test_all_forms_are_compiled_in_one_place() -> None:
    """A form that a module compiles by itself would wait for ever for a run that was killed."""
    package = ROOT / "hvi_fenicsx"
    direct = [file.name for file in package.rglob("*.py") if "fem.form(" in file.read_text(encoding="utf-8")]
    assert direct == ["forms.py"]


SLOW = """#!/bin/sh
touch "$0.started"
sleep 2
"""
WAYS = {"KILL": [signal.SIGKILL], "HUP": [signal.SIGHUP] * 2, "TERM": [signal.SIGTERM] * 2}


@pytest.mark.long
@pytest.mark.parametrize("way", WAYS)
def test_a_run_killed_while_forms_compile_does_not_stop_the_next(
    way: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = write_scene(tmp_path / "square.toml", model(2, friction=quadratic_linear(1e3)))
    compiler = tmp_path / "slow"
    compiler.write_text(SLOW)
    compiler.chmod(0o755)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    run = ("run", scene, "--out", tmp_path / "r", "--no-pictures")
    child = subprocess.Popen(command(*run), env=os.environ | {"CC": str(compiler)}, stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "slow.started").exists():
        time.sleep(0.01)
    for number in WAYS[way]:
        child.send_signal(number)
        time.sleep(0.1)
    assert "Traceback" not in child.communicate(timeout=60)[1]
    done = process(*run)
    assert (done.returncode, done.stderr) == (0, "")
    assert summary(tmp_path / "r")["converged"]
