"""A plugin is announced before it runs; what its methods do wrong is told with their file and name."""

from __future__ import annotations

import itertools
import logging
import re
from pathlib import Path
from typing import Any

import pytest
from runs import hvi, process
from scenes import model

from hvi_fenicsx import InputError, dump_scene, read_scene
from hvi_fenicsx.model import read_tables

LAW = """
from dataclasses import dataclass
from hvi_fenicsx import laws
from hvi_fenicsx.errors import InputError

@dataclass(frozen=True)
class Mine(laws.SampledLaw):
    name = "{name}"
    strength: float

    def traction(self, x):
        {traction}

    def ends(self):
        {ends}
"""
NAMES = (f"mine{number}" for number in itertools.count())


def scene(folder: Path, traction: str = "return 0 * x + self.strength", ends: str = "return [1e-6]") -> Path:
    """A scene whose floor has a law of a plugin; no two plugins of a process may have the same name."""
    name = next(NAMES)
    (folder / f"{name}.py").write_text(LAW.format(name=name, traction=traction, ends=ends), encoding="utf-8")
    tables: dict[str, Any] = model(2)
    text = f'plugins = "{name}.py"\n{dump_scene(read_tables(tables))}'
    friction = f'friction = {{ law = "{name}", strength = 1e3 }}'
    path = folder / "scene.toml"
    path.write_text(text.replace("[boundary.floor]", f"[boundary.floor]\n{friction}"), encoding="utf-8")
    return path


def test_a_plugin_is_announced_before_it_runs(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "loud.py").write_text("import logging; logging.getLogger('hvi_fenicsx').warning('it runs')")
    (tmp_path / "scene.toml").write_text('plugins = "loud.py"', encoding="utf-8")
    with caplog.at_level(logging.WARNING, logger="hvi_fenicsx"), pytest.raises(InputError):
        read_scene(tmp_path / "scene.toml")
    assert caplog.messages == [f"plugin {tmp_path / 'loud.py'}: its code is run", "it runs"]


@pytest.mark.parametrize("kind", ["law", "smoothing", "effect", "method"])
def test_a_name_that_is_no_text_is_refused(kind: str, tmp_path: Path) -> None:
    base, name = {
        "law": ("laws.PolylineLaw", "name"),
        "smoothing": ("laws.smoothing.Smoothing", "name"),
        "effect": ("effects.Effect", "place, key"),
        "method": ("solvers.Method", "name"),
    }[kind]
    module, value = base.rpartition(".")[0], "effects.Place.BODY, 3" if kind == "effect" else "3"
    text = f"import hvi_fenicsx.{module}\nfrom hvi_fenicsx import {module.split('.')[0]}\n"
    (tmp_path / f"odd_{kind}.py").write_text(f"{text}class A({base}):\n    {name} = {value}\n", encoding="utf-8")
    (tmp_path / "scene.toml").write_text(f'plugins = "odd_{kind}.py"', encoding="utf-8")
    with pytest.raises(InputError, match=rf"odd_{kind}\.py:3: TypeError: {kind} class A: its name must be a text"):
        read_scene(tmp_path / "scene.toml")


def test_a_plugin_that_ends_the_program_is_refused(tmp_path: Path) -> None:
    (tmp_path / "ending.py").write_text("import sys\nsys.exit(3)\n", encoding="utf-8")
    (tmp_path / "scene.toml").write_text('plugins = "ending.py"', encoding="utf-8")
    with pytest.raises(InputError, match=r"ending\.py:2: SystemExit"):
        read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize("error", ["GeneratorExit", "Odd"])
def test_an_error_of_any_kind_on_import_is_told(error: str, tmp_path: Path) -> None:
    """One that cannot be printed too."""
    odd = "class Odd(Exception):\n    def __str__(self): raise ValueError\n"
    (tmp_path / f"of_{error}.py").write_text(f"{odd}raise {error}\n", encoding="utf-8")
    (tmp_path / "scene.toml").write_text(f'plugins = "of_{error}.py"', encoding="utf-8")
    with pytest.raises(InputError, match=rf"of_{error}\.py:3: {error}"):
        read_scene(tmp_path / "scene.toml")


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"traction": "return 1 / 0"}, r":12: Mine\.traction raises ZeroDivisionError"),
        ({"traction": "raise SystemExit(1)"}, r":12: Mine\.traction raises SystemExit"),
        ({"traction": "raise BaseException('no')"}, r":12: Mine\.traction raises BaseException: no"),
        ({"ends": "raise InputError('my own words')"}, "my own words"),
    ],
)
def test_a_method_that_fails_is_named(wrong: dict[str, str], told: str, tmp_path: Path) -> None:
    done = hvi("check", scene(tmp_path, **wrong))
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 2  # the first announces the plugin
    assert re.search(told, done.stderr), done.stderr


def test_a_sound_plugin_is_solved(tmp_path: Path) -> None:
    assert hvi("run", scene(tmp_path), "--out", tmp_path / "r", "--no-pictures").returncode == 0


@pytest.mark.long
@pytest.mark.parametrize("only", ["True", "MPI.COMM_WORLD.rank == 1"])
def test_ranks_end_together(only: str, tmp_path: Path) -> None:
    """Whether one rank fails or all do."""
    fault = f"from mpi4py import MPI\n        if {only}: raise ValueError('no')\n        return 0 * x + 1e3"
    done = process("run", scene(tmp_path, traction=fault), "--out", tmp_path / "r", "--np", 2)
    assert done.returncode == 2
    assert sum("Mine.traction raises ValueError: no" in line for line in done.stderr.splitlines()) == 1, done.stderr


@pytest.mark.parametrize("name", ["s\udce9.toml", "d\udce9/s.toml"])
def test_a_name_that_is_not_utf8_is_refused(name: str, tmp_path: Path) -> None:
    done = hvi("check", tmp_path / name)
    assert done.returncode == 2
    assert r"s.toml: is not UTF-8" in done.stderr.replace(r"\udce9.", ".")
    with pytest.raises(InputError, match="not UTF-8; rename"):
        read_scene(tmp_path / name)


def test_control_characters_do_not_reach_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "\x1b[31m.toml").write_text('"\\u001b[31m" = 1', encoding="utf-8")
    done = hvi("check", tmp_path / "\x1b[31m.toml")
    assert done.returncode == 2
    assert "\x1b" not in done.stderr
    assert done.stderr.count(r"\u001b[31m") >= 2


def test_a_plugin_that_leaves_the_current_folder_takes_no_result_along(tmp_path: Path) -> None:
    before, file = Path.cwd(), scene(tmp_path)
    plugin = next(tmp_path.glob("*.py"))
    plugin.write_text(plugin.read_text(encoding="utf-8") + "\nimport os\nos.chdir('/')\n", encoding="utf-8")
    read_scene(file)
    assert Path.cwd() == before
