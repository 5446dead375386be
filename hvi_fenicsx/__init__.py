"""Semicoercive hemivariational inequalities of nonmonotone contact, on FEniCSx.

From Python (docs/python.md)::

    import hvi_fenicsx as hvi

    model = hvi.Model(
        hvi.Body.rectangle([1.0, 1.0], [16, 16]),
        [
            hvi.Isotropic(youngs_modulus=2.15e11, poisson_ratio=0.29),
            hvi.Displacement("left", [0.0, None]),
            hvi.Traction("top", [0.0, -1e6]),
            hvi.Contact("bottom"),
        ],
    )
    solution = hvi.solve(model)

Names are loaded when they are first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

_HOME = {
    "__version__": "runtime.versions",
    "Adhesion": "effects",
    "Anisotropic": "effects",
    "Body": "model",
    "BodyForce": "effects",
    "Cohesion": "effects",
    "Contact": "effects",
    "Displacement": "effects",
    "Energy": "model.energy",
    "Force": "effects",
    "Friction": "effects",
    "InputError": "errors",
    "Isotropic": "effects",
    "Model": "model",
    "Moment": "effects",
    "NewtonStep": "runtime.log",
    "Orthotropic": "effects",
    "Pressure": "effects",
    "Solution": "api",
    "Superpotential": "laws",
    "Support": "effects",
    "Temperature": "effects",
    "Traction": "effects",
    "check": "api",
    "dump_scene": "model",
    "equilibria": "api",
    "follow": "api",
    "prepare": "workflow",
    "read_scene": "model",
    "read_tables": "model",
    "set_log_level": "runtime.log",
    "solve": "api",
    "study": "api",
}
__all__ = sorted([*_HOME, "laws"])

if TYPE_CHECKING:
    from . import laws
    from .api import Solution, check, equilibria, follow, solve, study
    from .effects import (
        Adhesion,
        Anisotropic,
        BodyForce,
        Cohesion,
        Contact,
        Displacement,
        Force,
        Friction,
        Isotropic,
        Moment,
        Orthotropic,
        Pressure,
        Support,
        Temperature,
        Traction,
    )
    from .errors import InputError
    from .laws import Superpotential
    from .model import Body, Model, dump_scene, read_scene, read_tables
    from .model.energy import Energy
    from .runtime.log import NewtonStep, set_log_level
    from .runtime.manifest import __version__
    from .workflow import prepare


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name == "laws":
        return importlib.import_module(".laws", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)


class _Package(ModuleType):
    """The package, in which a function keeps its name where a room has the same one: ``hvi.study``."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
