"""``manifest.json``: which files of a folder the program wrote, and what was in them.

By it the program knows a folder as its own, removes no file that it did not write, and finds what was damaged since.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any, Literal, get_args

from . import writing
from .versions import __version__

NAME = "manifest.json"
Kind = Literal["result", "study"]
MARKS: Mapping[Kind, str] = {"result": "summary.json", "study": "study.json"}
"""The file by which others know that the folder is finished: the first to go and the last to come."""
_PROGRAM, _FORMAT = "hvi_fenicsx", 1


@dataclass(frozen=True, kw_only=True)
class Manifest:
    """What a folder holds of the program's.

    Attributes:
        kind: of the folder.
        files: SHA-256 by name, relative to the folder; None for files that still change.
        inputs: SHA-256 of the files that the scene named, by their name there.
    """

    kind: Kind
    files: Mapping[str, str | None]
    inputs: Mapping[str, str] = field(default_factory=dict)

    @property
    def owned(self) -> frozenset[str]:
        """The names of all files, its own among them."""
        return frozenset({*self.files, NAME})

    def damaged(self, folder: Path) -> str | None:
        """The first file that is not as it was written; None if all are.

        Args:
            folder: that of the manifest.
        """
        return next((n for n, known in self.files.items() if known and digest(folder / n) != known), None)


def read(folder: Path) -> Manifest | None:
    """The manifest of a folder; None where there is none, or one that this program did not write."""
    try:
        found = json.loads((folder / NAME).read_text(encoding="utf-8"))
        if found["program"] != _PROGRAM or found["format"] != _FORMAT or found["kind"] not in get_args(Kind):
            return None
        files = {_inside(name): known for name, known in dict(found["files"]).items()}
        return Manifest(kind=found["kind"], files=files, inputs=dict(found["inputs"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _inside(name: str) -> str:
    """A name that stays within its folder."""
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts or not path.parts or "\0" in name:
        raise ValueError(name)
    return name


def write(folder: Path, manifest: Manifest) -> None:
    """Write a manifest into its folder, whole or not at all, also if the power fails.

    Args:
        folder: where to.
        manifest: what it says.

    Raises:
        NotWrittenError: it cannot be written.
    """
    data: dict[str, Any] = {"program": _PROGRAM, "format": _FORMAT, "version": __version__, **vars(manifest)}
    with writing.whole(folder / NAME) as aside, aside.open("w", encoding="utf-8") as file:
        file.write(json.dumps(data, indent=1) + "\n")
        file.flush()
        os.fsync(file.fileno())


def listed(folder: Path) -> dict[str, str | None]:
    """The files of a folder with their SHA-256, as a manifest lists them; not what was left half-written."""
    names = (path.name for path in sorted(folder.iterdir()) if path.name != NAME and not path.name.startswith("."))
    return {name: digest(folder / name) for name in names}


def add(folder: Path, names: Iterable[str], *, changing: bool = False) -> None:
    """Add files to the manifest of a folder; nothing where it has none.

    Args:
        folder: the folder.
        names: the files.
        changing: whether they still change, or are yet to come.

    Raises:
        NotWrittenError: the manifest cannot be written.
    """
    known = read(folder)
    if known is None:
        return
    files = {**known.files, **{name: None if changing else digest(folder / name) for name in names}}
    if files != known.files:
        write(folder, replace(known, files=files))


def digest(file: Path) -> str | None:
    """The SHA-256 of a file's content; None where there is no such file."""
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None
