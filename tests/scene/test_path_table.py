"""The table of the load path: what is read, and what is refused in which words."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from scenes import model, quadratic_linear

from hvi_fenicsx import InputError, Model, dump_scene, read_scene, read_tables


def read(tmp_path: Path, *overrides: str) -> Model:
    file = tmp_path / "s.toml"
    file.write_text(dump_scene(read_tables(model(4, friction=quadratic_linear(1e6)))), encoding="utf-8")
    return read_scene(file, overrides)


def test_a_scene_without_the_table_has_no_path(tmp_path: Path) -> None:
    assert read(tmp_path).path is None


READ: dict[str, dict[str, Any]] = {
    "path={to=1.5}": {"to": (1.5,), "scaled": None, "follow": "stable", "memory": True},
    "path={to=[1, 0, 2]}": {"to": (1.0, 0.0, 2.0)},
    "path={to=-1, scaled='pull.traction', follow='exact', memory=false}": {
        "to": (-1.0,),
        "scaled": ("pull.traction",),
        "follow": "exact",
        "memory": False,
    },
    "path={contact_at=[0.5, 1]}": {"to": (1.0,), "contact_at": (0.5, 1.0)},
}


@pytest.mark.parametrize("text", READ)
def test_what_is_read_and_written_again(text: str, tmp_path: Path) -> None:
    scene = read(tmp_path, text)
    assert {key: getattr(scene.path, key) for key in READ[text]} == READ[text]
    again = tmp_path / "again.toml"
    again.write_text(dump_scene(scene), encoding="utf-8")
    assert read_scene(again) == scene


REFUSED = {
    "path={to=0}": "path.to: goes from 0 to 0, which is no way",
    "path={to=[]}": "path.to: is an empty list",
    "path={to=[1, 0.5, 0.5]}": "path.to: goes from 0.5 to 0.5, which is no way",
    "path={to=true}": "path.to: must be a number (is true)",
    "path={to=inf}": "path.to: must be 1e+100 or less",
    "path={scaled='pull'}": 'path.scaled: unknown load, prescribed displacement or moved obstacle "pull"; allowed: '
    "wall.displacement, pull.traction, press.traction",
    "path={scaled='floor.friction'}": 'prescribed displacement or moved obstacle "floor.friction"',
    "path={follow='slowly'}": 'path.follow: unknown value "slowly"',
    "path={memory=1}": "path.memory: must be true or false",
    "path={steps=3}": "path.steps: unknown key",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path, text)
    assert REFUSED[text] in str(caught.value)
