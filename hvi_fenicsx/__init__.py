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

_NAMES = {
    "api": ("Solution", "check", "equilibria", "follow", "solve", "study"),
    "effects.contact": ("Contact",),
    "effects.elasticity": ("Anisotropic", "Isotropic", "Orthotropic"),
    "effects.law_effects": ("Adhesion", "Cohesion", "Friction", "Support"),
    "effects.loads": ("BodyForce", "Displacement", "Force", "Moment", "Pressure", "Temperature", "Traction"),
    "errors": ("InputError",),
    "laws": ("Superpotential",),
    "model": ("Body", "Model", "dump_scene", "read_scene", "read_tables"),
    "model.energy": ("Energy",),
    "runtime.log": ("NewtonStep", "set_log_level"),
    "runtime.manifest": ("__version__",),
    "workflow": ("prepare",),
}
_HOME = {name: room for room, names in _NAMES.items() for name in names}
__all__ = sorted([*_HOME, "laws"])

if TYPE_CHECKING:
    from . import laws
    from .api import Solution, check, equilibria, follow, solve, study
    from .effects.contact import Contact
    from .effects.elasticity import Anisotropic, Isotropic, Orthotropic
    from .effects.law_effects import Adhesion, Cohesion, Friction, Support
    from .effects.loads import BodyForce, Displacement, Force, Moment, Pressure, Temperature, Traction
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
