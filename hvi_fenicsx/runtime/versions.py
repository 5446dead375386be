"""Versions of everything a result depends on."""

from __future__ import annotations

import functools
import importlib.metadata
import os
import platform
import sys
from pathlib import Path

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

    found = {
        "hvi_fenicsx": with_revision(),
        "python": platform.python_version(),
        "dolfinx": VERSION,
        "petsc": petsc_version(),
    }
    return {**found, **{name: _version(name) for name in _MODULES}, "platform": sys.platform}


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
