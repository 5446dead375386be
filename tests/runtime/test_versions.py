"""The version that results name: with the commit in a clone, in a further working tree, or in an image of one."""

from __future__ import annotations

from pathlib import Path

import pytest

import hvi_fenicsx as hvi
from hvi_fenicsx.runtime.manifest import __version__, with_revision

COMMIT = "3812cfc10a9d4f5e6b7c8d9e0f1a2b3c4d5e6f70"
SHOWN = f"{__version__}+g3812cfc10a"


def test_every_public_name_is_there() -> None:
    """They are loaded when they are first used, each from the module that is listed for it."""
    assert all(hasattr(hvi, name) for name in hvi.__all__)
    assert hvi.__version__ == __version__


def git_folder(folder: Path, log: str = f"0000 {COMMIT} A <a@b> 1 +0000\tcommit: x\n") -> Path:
    """Git's own log of what was checked out."""
    (folder / "logs").mkdir(parents=True)
    (folder / "logs" / "HEAD").write_text(log, encoding="utf-8")
    return folder


def test_a_clone_and_a_further_working_tree(tmp_path: Path) -> None:
    git_folder(tmp_path / "main" / ".git")
    assert with_revision(tmp_path / "main") == SHOWN
    other = git_folder(tmp_path / "main" / ".git" / "worktrees" / "other")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / ".git").write_text(f"gitdir: {other}\n", encoding="utf-8")
    assert with_revision(tmp_path / "other") == SHOWN


def test_an_image_names_its_commit_and_an_installed_package_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("HVI_REVISION", raising=False)
    assert with_revision(tmp_path) == __version__
    git_folder(tmp_path / "torn" / ".git", "")
    assert with_revision(tmp_path / "torn") == __version__
    monkeypatch.setenv("HVI_REVISION", COMMIT)
    assert with_revision(tmp_path) == SHOWN
