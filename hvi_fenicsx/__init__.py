"""Semicoercive hemivariational inequalities of nonmonotone contact, on FEniCSx.

From Python: ``from hvi_fenicsx import Scene, read_scene, solve``. Names are loaded when they are first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

_HOME = {
    "__version__": "runtime.versions",
    "InputError": "errors",
    "Scene": "scene",
    "Solution": "solution",
    "Superpotential": "laws",
    "dump_scene": "scene",
    "prepare": "workflow",
    "read_scene": "scene",
    "solve": "workflow",
}
__all__ = [
    "InputError",
    "Scene",
    "Solution",
    "Superpotential",
    "__version__",
    "dump_scene",
    "prepare",
    "read_scene",
    "solve",
]

if TYPE_CHECKING:
    from .errors import InputError
    from .laws import Superpotential
    from .runtime.versions import __version__
    from .scene import Scene, dump_scene, read_scene
    from .solution import Solution
    from .workflow import prepare, solve


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
