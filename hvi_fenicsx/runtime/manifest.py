"""Where a result comes from: ``manifest.json``, and the versions of everything that it depends on.

The manifest says which files of a folder the program wrote, and what was in them. By it the program knows a folder as
its own, removes no file that it did not write, and finds what was damaged since.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import json
import os
import platform
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

from . import writing

NAME = "manifest.json"
Kind = Literal["result", "path", "search", "study"]
MARKS: Mapping[Kind, str] = {**dict.fromkeys(get_args(Kind), "summary.json"), "study": "study.json"}
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
        found = json.loads(writing.content(folder / NAME))
        if found["program"] != _PROGRAM or found["format"] != _FORMAT or found["kind"] not in get_args(Kind):
            return None
        files = {_inside(name): known for name, known in dict(found["files"]).items()}
        return Manifest(kind=found["kind"], files=files, inputs=dict(found["inputs"]))
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None


def _inside(name: str) -> str:
    """A name of something in its folder itself, not in one of that, which may be a link."""
    if name in ("", ".", "..") or "/" in name or "\0" in name or len(name.encode()) > 255:
        raise ValueError(name)
    return name


def write(folder: Path, manifest: Manifest, within: Path | None = None) -> None:
    """Write a manifest into its folder, whole or not at all, also if the power fails.

    Args:
        folder: where to.
        manifest: what it says.
        within: where it is until it is whole; by default in the folder.

    Raises:
        NotWrittenError: it cannot be written.
    """
    data: dict[str, Any] = {"program": _PROGRAM, "format": _FORMAT, "version": __version__, **vars(manifest)}
    with writing.whole(folder / NAME, within) as aside, aside.open("w", encoding="utf-8") as file:
        file.write(json.dumps(data, indent=1) + "\n")
        file.flush()
        os.fsync(file.fileno())


def listed(folder: Path) -> dict[str, str | None]:
    """The files of a folder with their SHA-256, as a manifest lists them; not what was left half-written."""
    names = (path.name for path in sorted(folder.iterdir()) if path.name != NAME and not path.name.startswith("."))
    return {name: digest(folder / name) for name in names}


def add(folder: Path, names: Iterable[str]) -> None:
    """Add files to the manifest of a folder; nothing where it has none.

    Args:
        folder: the folder.
        names: the files.

    Raises:
        NotWrittenError: the manifest cannot be written.
    """
    known = read(folder)
    if known is None:
        return
    files = {**known.files, **{name: digest(folder / name) for name in names}}
    write(folder, replace(known, files=files))


def digest(file: Path) -> str | None:
    """The SHA-256 of a file's content; None where there is no such file."""
    try:
        with writing.opened(file) as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return None


__version__ = "0.1.0"
"""The release; this is the only place that states it."""
_ROOT = Path(__file__).parents[2]
_REVISION = "HVI_REVISION"
"""The variable by which an image names the commit that it was built from."""
_SHORT = 10
"""Digits of a commit's name that are shown."""

_MODULES = ("numpy", "scipy", "pydantic", "mpi4py", "pyvista", "matplotlib", "gmsh")


def versions() -> dict[str, str]:
    """Versions by name; "absent" for what is not installed."""
    from ..compat import VERSION, petsc_version

    return {
        "hvi_fenicsx": with_revision(),
        "python": platform.python_version(),
        "dolfinx": VERSION,
        "petsc": petsc_version(),
        **{name: _version(name) for name in _MODULES},
        "platform": sys.platform,
    }


def with_revision(root: Path = _ROOT) -> str:
    """The version, with the commit after a plus sign where the program runs from a clone or from an image of one.

    Args:
        root: of the repository.
    """
    found = _checked_out(root / ".git") or os.environ.get(_REVISION)
    return f"{__version__}+g{found[:_SHORT]}" if found else __version__


def _checked_out(folder: Path) -> str | None:
    """The commit that is checked out, by git's own log: git may be absent; None where there is no repository."""
    try:
        if folder.is_file():  # a further working tree
            folder = folder.parent / folder.read_text(encoding="utf-8").removeprefix("gitdir:").strip()
        return (folder / "logs" / "HEAD").read_text(encoding="utf-8").splitlines()[-1].split()[1]
    except (OSError, UnicodeDecodeError, IndexError):
        return None


@functools.cache
def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "absent"
