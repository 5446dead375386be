"""Files that a scene names, looked for beside it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer, SerializationInfo, ValidationInfo

from .messages import refusal


def _existing(value: Any, info: ValidationInfo) -> Path:
    if not isinstance(value, str | Path) or not str(value).strip() or "\0" in str(value):
        raise refusal('must be the name of a file in quotes, like "part.msh"')
    folder = (info.context or {}).get("folder", ".")
    path = Path(os.path.abspath(Path(folder) / value))
    if not path.is_file():
        raise refusal(f"{path} {'is a folder' if path.is_dir() else 'does not exist'}")
    return path


def _written(path: Path, info: SerializationInfo) -> str:
    """The path from the folder that the scene is written into; absolute where that is not known."""
    folder = (info.context or {}).get("folder")
    return str(path) if folder is None else os.path.relpath(path, folder)


ExistingFile = Annotated[Path, BeforeValidator(_existing), PlainSerializer(_written)]
"""A file that exists, absolute; its context has the folder that its name is relative to."""
