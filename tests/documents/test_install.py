"""The package as ``pip install .`` builds it: what it holds, and that it works away from the repository."""

from __future__ import annotations

import configparser
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from runs import ROOT

from hvi_fenicsx.runtime.processes import environment

pytestmark = pytest.mark.long
BUILD = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
DATA = {".py", ".j2", ".css", ".typed"}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The wheel, by the build backend itself: pip adds a network and an environment, which are not ours to test."""
    pytest.importorskip("setuptools", minversion="77")
    source, built = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in ("README.md", "LICENSE", "pyproject.toml"):
        shutil.copy(ROOT / name, source)
    for name in ("hvi_fenicsx", "tests", "benchmarks", "docs", "demos"):
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    subprocess.run([sys.executable, "-c", BUILD, built], cwd=source, check=True, capture_output=True, timeout=120)
    (file,) = built.glob("*.whl")
    return zipfile.ZipFile(file)


def test_it_holds_the_package_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    packed = {name for name in wheel.namelist() if ".dist-info/" not in name}
    here = {str(f.relative_to(ROOT)) for f in (ROOT / "hvi_fenicsx").rglob("*") if f.suffix in DATA}
    assert packed == here
    assert "hvi_fenicsx/py.typed" in packed


def test_its_command_runs_a_scene_elsewhere(wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    """Serial and, since ranks and pictures are processes of their own that must find it too, on two ranks."""
    wheel.extractall(tmp_path / "site")
    entry = configparser.ConfigParser()
    (points,) = (tmp_path / "site").glob("*.dist-info/entry_points.txt")
    entry.read(points)
    module, _, function = entry["console_scripts"]["hvi"].partition(":")
    code = f"import sys, {module} as m; print(m.__file__, flush=True); sys.exit(m.{function}())"
    settings = {**environment(), "PYTHONPATH": str(tmp_path / "site")}
    for ranks in (1, 2):
        words = ["run", ROOT / "demos" / "strong_law.toml", "--out", f"r{ranks}", "--np", str(ranks)]
        done = subprocess.run(
            [sys.executable, "-c", code, *words],
            cwd=tmp_path,
            env=settings,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(str(tmp_path / "site"))
        names = {file.name for file in (tmp_path / f"r{ranks}").iterdir()}
        assert {"report.html", "summary.json", "contact.png", "body.png"} <= names
