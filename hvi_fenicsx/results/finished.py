"""Whether a folder holds a finished result of a scene, as the program wrote it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

from ..runtime import manifest
from ..runtime.manifest import MARKS
from ..scene import Scene, dump_scene
from .folder import inputs_of

_READ = ("scene.toml", MARKS["result"])


class Finished(NamedTuple):
    """A folder that should hold a result of a scene.

    Attributes:
        record: what ``summary.json`` says; None where there is no such result, or not as it was written.
        fault: why a result that is there cannot be kept; None where nothing is wrong with it.
    """

    record: dict[str, Any] | None = None
    fault: str | None = None


def read(target: Path, scene: Scene) -> Finished:
    """The result of a scene in a folder, if one is there, whole and of the same mesh files and plugins.

    Args:
        target: the folder, without symbolic links.
        scene: the scene.
    """
    found = manifest.read(target)
    if found is None or found.kind != "result":
        return Finished()
    damaged = found.damaged(target)
    if damaged is None:
        damaged = next((name for name in _READ if not found.files.get(name)), None)  # listed without what was in it
    if damaged is not None:
        return Finished(fault=f"{damaged} is not as it was written")
    if (target / "scene.toml").read_text(encoding="utf-8") != dump_scene(scene, target):
        return Finished()
    if found.inputs != inputs_of(scene, target):
        return Finished(fault="a file that the scene reads has changed")
    return Finished(json.loads((target / MARKS["result"]).read_text(encoding="utf-8")))
