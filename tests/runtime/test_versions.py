"""The version that results name: with the commit in a clone, in a further working tree, or in an image of one."""

from __future__ import annotations

from pathlib import Path

import pytest

from hvi_fenicsx.runtime.versions import __version__, with_revision

COMMIT = "3812cfc10a9d4f5e6b7c8d9e0f1a2b3c4d5e6f70"
SHOWN = f"{__version__}+g3812cfc10a"


def git_folder(folder: Path, **files: str) -> Path:
    """Git's own files, by their names with dots for slashes."""
    for name, text in files.items():
        file = folder / name.replace("__", "/").replace("_", "-" if "packed" in name else "_")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
    return folder


def test_a_branch_a_packed_branch_and_a_commit_alone(tmp_path: Path) -> None:
    git_folder(tmp_path / "a" / ".git", HEAD="ref: refs/heads/main\n", refs__heads__main=f"{COMMIT}\n")
    packed = f"# pack-refs with: peeled\n{COMMIT} refs/heads/main\n"
    git_folder(tmp_path / "b" / ".git", HEAD="ref: refs/heads/main\n", packed_refs=packed)
    git_folder(tmp_path / "c" / ".git", HEAD=f"{COMMIT}\n")
    assert [with_revision(tmp_path / name) for name in "abc"] == 3 * [SHOWN]


def test_a_further_working_tree(tmp_path: Path) -> None:
    main = git_folder(tmp_path / "main" / ".git", refs__heads__other=f"{COMMIT}\n")
    git_folder(main / "worktrees" / "other", HEAD="ref: refs/heads/other\n", commondir="../..\n")
    tree = git_folder(tmp_path / "other", **{".git": f"gitdir: {main}/worktrees/other\n"})
    assert with_revision(tree) == SHOWN


def test_an_image_names_its_commit_and_an_installed_package_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("HVI_REVISION", raising=False)
    assert with_revision(tmp_path) == __version__
    git_folder(tmp_path / "torn" / ".git", HEAD="ref: refs/heads/main\n")
    assert with_revision(tmp_path / "torn") == __version__
    monkeypatch.setenv("HVI_REVISION", COMMIT)
    assert with_revision(tmp_path) == SHOWN
