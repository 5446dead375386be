"""The points of a study in its folder: finished ones by the scene that they solve, each file whole or not there.

A point's name is a digest of its scene, the mesh file's content, the number of ranks and the program's version; so a
study that is resumed, or widened by further axes, finds what it has.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..runtime import manifest, writing
from ..runtime.manifest import Manifest
from ..runtime.versions import __version__
from ..scene import dump_scene
from .setting import Setting

POINTS = "points"
_ENDINGS = (".toml", ".json", ".npz", ".stiffness.npz")
"""How the names of a point's files end."""


@dataclass(frozen=True)
class Store:
    """The points in the folder of a study.

    Attributes:
        folder: the folder.
        ranks: that its points run on.
    """

    folder: Path
    ranks: int = 1

    def name(self, setting: Setting) -> str:
        """The name of a setting's point."""
        digest = hashlib.sha256(f"{__version__} {self.ranks} {setting.accuracy}\n{dump_scene(setting.scene)}".encode())
        for file in setting.scene.files():
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
        return found if isinstance(found, dict) and found.keys() >= failed("", 0).keys() else None

    def open(self) -> None:
        """Make the folder ready for points.

        Raises:
            OSError: it cannot be written.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        if manifest.read(self.folder) is None:  # first of all: without it the folder would be one of others
            manifest.write(self.folder, Manifest(kind="study", files={}))
        (self.folder / POINTS).mkdir(exist_ok=True)

    def announce(self, setting: Setting) -> None:
        """List a point's files as the program's own, before they are there.

        Raises:
            NotWrittenError: the list cannot be written.
        """
        names = [f"{POINTS}/{self.name(setting)}{ending}" for ending in _ENDINGS]
        manifest.add(self.folder, names, changing=True)

    def listed(self) -> dict[str, str | None]:
        """The files of all points, as a manifest lists them."""
        found = manifest.read(self.folder)
        return {name: known for name, known in (found.files if found else {}).items() if name.startswith(f"{POINTS}/")}


def failed(reason: str, code: int) -> dict[str, Any]:
    """The record of a point that has no certified solution.

    Args:
        reason: why.
        code: the exit code.
    """
    return {"converged": False, "reason": reason, "exit_code": code, "cost": None}


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

    Raises:
        NotWrittenError: it cannot be written.
    """
    writing.text(path, json.dumps(data, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
