"""Semicoercive hemivariational inequalities of nonmonotone contact, on FEniCSx.

From Python: ``from hvi_fenicsx import Scene, read_scene, solve``. Names are loaded when they are first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "InputError": "errors",
    "Scene": "scene",
    "Solution": "solution",
    "Superpotential": "laws",
    "dump_scene": "scene",
    "prepare": "solution",
    "read_scene": "scene",
    "solve": "solution",
}
__all__ = ["InputError", "Scene", "Solution", "Superpotential", "dump_scene", "prepare", "read_scene", "solve"]

if TYPE_CHECKING:
    from .errors import InputError
    from .laws import Superpotential
    from .scene import Scene, dump_scene, read_scene
    from .solution import Solution, prepare, solve


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
