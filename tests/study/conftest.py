"""A small finished study, for all tests of studies."""

from __future__ import annotations

from pathlib import Path

import pytest
from runs import hvi, write_scene
from scenes import model, quadratic_linear


@pytest.fixture(scope="session")
def studied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with a scene and, in ``out``, its study along ``--axis epsilon=1,0.1``."""
    folder = tmp_path_factory.mktemp("study")
    file = write_scene(folder / "square.toml", model(2, friction=quadratic_linear(1.0e6)))
    done = hvi("study", file, "--axis", "epsilon=1,0.1", "--out", folder / "out", "--repeat", 1)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return folder
