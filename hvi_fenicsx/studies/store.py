"""The folder of a study: finished points by the scene that they solve, each file whole or not there.

A point's name is a digest of its scene, the mesh file's content, the number of ranks and the program's version; so a
study that is resumed, or widened by further axes, finds what it has.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ..errors import InputError
from ..runtime.versions import __version__
from ..scene import dump_scene
from .setting import Setting

MARK = "study.json"
POINTS = "points"
Existing = Literal["refuse", "replace", "resume"]
_RECORDED = {"converged", "reason", "exit_code", "cost"}
"""What every record has, also that of a point that failed."""


@dataclass(frozen=True)
class Store:
    """The folder of a study.

    Attributes:
        folder: the folder.
        ranks: that its points run on.
    """

    folder: Path
    ranks: int = 1

    def name(self, setting: Setting) -> str:
        """The name of a setting's point."""
        digest = hashlib.sha256(f"{__version__} {self.ranks} {setting.accuracy}\n{dump_scene(setting.scene)}".encode())
        for file in setting.scene.domain.files():
            digest.update(file.read_bytes())
        return digest.hexdigest()[:16]

    def path(self, setting: Setting) -> Path:
        """A point's files, without their endings."""
        return self.folder / POINTS / self.name(setting)

    def solution(self, setting: Setting) -> Path:
        """A point's solution."""
        return self.path(setting).with_suffix(".npz")

    def stiffness(self, setting: Setting) -> Path:
        """A reference's stiffness."""
        return self.path(setting).with_suffix(".stiffness.npz")

    def record(self, setting: Setting) -> dict[str, Any] | None:
        """What a finished point cost and found; None where it is not finished, or its record is damaged."""
        try:
            found = json.loads(self.path(setting).with_suffix(".json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return found if isinstance(found, dict) and found.keys() >= _RECORDED else None

    def open(self, existing: Existing) -> None:
        """Make the folder ready.

        Raises:
            InputError: it holds a study and that is to be refused, or other files, or cannot be written.
        """
        try:
            if self.folder.exists():
                self._check(existing)
            if existing == "replace":
                self._clear()
            (self.folder / POINTS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"--out {self.folder}: cannot be written: {error.strerror or error}; choose another folder"
            ) from None

    def _check(self, existing: Existing) -> None:
        if not self.folder.is_dir():
            raise InputError(f"--out {self.folder}: is a file; choose a folder")
        inside = {entry.name for entry in self.folder.iterdir()}
        if inside and not inside & {MARK, POINTS}:
            raise InputError(f"--out {self.folder}: holds other files; choose a new or empty folder")
        if inside and existing == "refuse":
            state = "already holds a study" if MARK in inside else "holds an unfinished study"
            raise InputError(
                f"--out {self.folder}: {state}; --resume keeps its finished points, --force begins anew, "
                "--out DIR writes beside"
            )

    def _clear(self) -> None:
        shutil.rmtree(self.folder / POINTS, ignore_errors=True)
        for file in (MARK, "study.csv", *(p.name for p in self.folder.glob("*.png"))):
            (self.folder / file).unlink(missing_ok=True)


def is_whole(archive: Path) -> bool:
    """Whether arrays are there and unharmed; a power cut tears also what was renamed into place."""
    try:
        with zipfile.ZipFile(archive) as opened:
            return opened.testzip() is None
    except (OSError, EOFError, ValueError, RuntimeError, zipfile.BadZipFile, zlib.error):
        return False


def write_json(path: Path, data: Mapping[str, Any]) -> None:
    """Write JSON, whole or not at all.

    Args:
        path: the file.
        data: what it says.
    """
    write_text(path, json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text, whole or not at all.

    Args:
        path: the file.
        text: what it says.
    """
    aside = path.with_name(f".{path.name}.{os.getpid()}")
    aside.write_text(text, encoding="utf-8")
    os.replace(aside, path)
