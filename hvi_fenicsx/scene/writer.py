"""A scene back into TOML: with every default written out, so that it can be read again on any day."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from .scene import Scene


def dump_scene(scene: Scene, folder: Path | None = None) -> str:
    """The resolved scene as TOML; read again from that folder it gives an equal scene. Not collective.

    Args:
        scene: the scene.
        folder: from which the paths of mesh files and plugins are given; None: absolute paths.
    """
    tables = scene.model_dump(exclude_none=True, context=None if folder is None else {"folder": folder})
    return tomli_w.dumps({key: value for key, value in tables.items() if value != {}})
