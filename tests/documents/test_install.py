"""The package as ``pip install .`` builds it: what it holds, and that it works away from the repository."""

from __future__ import annotations

import configparser
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
from runs import ROOT

from hvi_fenicsx.runtime.manifest import __version__
from hvi_fenicsx.runtime.processes import environment

pytestmark = pytest.mark.long
DATA = {".py", ".j2", ".css", ".typed"}


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a build sees of the repository."""
    pytest.importorskip("setuptools", minversion="77")
    copy = tmp_path_factory.mktemp("source")
    for name in ("README.md", "LICENSE", "pyproject.toml"):
        shutil.copy(ROOT / name, copy)
    for name in ("hvi_fenicsx", "tests", "benchmarks", "docs", "demos"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    return copy


def built(kind: str, source: Path, folder: Path) -> Path:
    """A wheel or sdist by the build backend itself: pip adds a network and an environment, not ours to test."""
    code = f"import sys; from setuptools import build_meta; build_meta.build_{kind}(sys.argv[1])"
    subprocess.run([sys.executable, "-c", code, folder], cwd=source, check=True, capture_output=True, timeout=120)
    (file,) = folder.iterdir()
    return file


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    """The wheel."""
    return zipfile.ZipFile(built("wheel", source, tmp_path_factory.mktemp("wheel")))


def test_the_sdist_gives_the_same_wheel(source: Path, wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    for name in ("sdist", "unpacked", "wheel"):
        (tmp_path / name).mkdir()
    with tarfile.open(built("sdist", source, tmp_path / "sdist")) as archive:
        archive.extractall(tmp_path / "unpacked", filter="data")
    (unpacked,) = (tmp_path / "unpacked").iterdir()
    again = zipfile.ZipFile(built("wheel", unpacked, tmp_path / "wheel"))
    assert {n: again.read(n) for n in again.namelist() if ".dist-info/" not in n} == {
        n: wheel.read(n) for n in wheel.namelist() if ".dist-info/" not in n
    }


def test_the_conda_recipe_has_the_requirements_of_pip() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    recipe = (ROOT / ".ci/conda/recipe.yaml").read_text()
    listed = recipe.partition("  run:")[2].partition("tests:")[0]
    asked = set(re.findall(r"^    - ([\w-]+(?: >=[\d.]+)?)$", listed, flags=re.MULTILINE))
    renamed = {"matplotlib": "matplotlib-base", "gmsh": "python-gmsh"}
    extras = [*project["optional-dependencies"]["gmsh"], *project["optional-dependencies"]["pyvista"]]
    wanted = {renamed.get(name, name).replace(">=", " >=") for name in [*project["dependencies"], *extras]}
    assert wanted <= asked
    assert f'version: "{__version__}"' in recipe
    assert f"- python {project['requires-python']}" in recipe
    assert all(f"{command} = {target}" in recipe for command, target in project["scripts"].items())


def test_one_version_is_stated_everywhere(wheel: zipfile.ZipFile) -> None:
    assert any(name == f"hvi_fenicsx-{__version__}.dist-info/METADATA" for name in wheel.namelist())
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"({__version__})" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()[2]


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
