"""Paths as the page says them: by the file's name, since its reader has other folders."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping
from pathlib import PurePath
from typing import Any

_ABSOLUTE = re.compile(r"""(?P<before>^|=|=["'])/(?:[^/"']*/)*(?P<name>[^/"']*)""")
"""A path from the root as a word of a command line, or after an equals sign in it."""


def files(scene: Mapping[str, Any]) -> Iterator[str]:
    """The files that a scene names: its mesh and its plugins.

    Args:
        scene: its tables.
    """
    mesh = (scene.get("domain") or {}).get("file")
    yield from [str(mesh)] if mesh else []
    yield from map(str, scene.get("plugins") or ())


def beside(text: str, scene: Mapping[str, Any]) -> str:
    """A scene's text as if the files that it names were beside it.

    Args:
        text: the scene as TOML.
        scene: its tables.
    """
    for file in files(scene):
        text = text.replace(f'"{file}"', f'"{PurePath(file).name}"')
    return text


def command(text: str) -> str:
    """A command line, of each absolute path the last part alone."""
    return shlex.join(_ABSOLUTE.sub(r"\g<before>\g<name>", word) for word in shlex.split(text))
