"""Versions of everything a result depends on."""

from __future__ import annotations

import importlib.metadata
import platform
import sys

__version__ = "0.1.0"

_MODULES = ("numpy", "scipy", "pydantic", "mpi4py", "pyvista", "matplotlib", "gmsh")


def versions() -> dict[str, str]:
    """Versions by name; "absent" for what is not installed."""
    from ..compat import VERSION, petsc_version

    found = {
        "hvi_fenicsx": __version__,
        "python": platform.python_version(),
        "dolfinx": VERSION,
        "petsc": petsc_version(),
    }
    return {**found, **{name: _version(name) for name in _MODULES}, "platform": sys.platform}


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "absent"
