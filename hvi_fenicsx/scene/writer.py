"""A scene back into TOML: with every default written out, so that it can be read again on any day."""

from __future__ import annotations

import tomli_w

from .scene import Scene


def dump_scene(scene: Scene) -> str:
    """The resolved scene as TOML; read again it gives an equal scene. A mesh file's path is absolute."""
    tables = scene.model_dump(exclude_none=True)
    return tomli_w.dumps({key: value for key, value in tables.items() if value != {}})
