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
from typing import TYPE_CHECKING, Any

_HOME = {
    "__version__": "runtime.versions",
    "Adhesion": "modelling",
    "Anisotropic": "modelling",
    "Body": "modelling",
    "BodyForce": "modelling",
    "Cohesion": "modelling",
    "Contact": "modelling",
    "Displacement": "modelling",
    "Energy": "modelling",
    "Force": "modelling",
    "Friction": "modelling",
    "InputError": "errors",
    "In": "modelling",
    "Isotropic": "modelling",
    "Model": "modelling",
    "Moment": "modelling",
    "NewtonStep": "runtime.log",
    "On": "modelling",
    "Orthotropic": "modelling",
    "Pressure": "modelling",
    "Scene": "scene",
    "Solution": "modelling",
    "Superpotential": "laws",
    "Support": "modelling",
    "Temperature": "modelling",
    "Traction": "modelling",
    "check": "modelling",
    "dump_scene": "scene",
    "equilibria": "modelling",
    "follow": "modelling",
    "prepare": "workflow",
    "read_scene": "scene",
    "set_log_level": "runtime.log",
    "solve": "modelling",
    "study": "modelling",
}
__all__ = [
    "Adhesion",
    "Anisotropic",
    "Body",
    "BodyForce",
    "Cohesion",
    "Contact",
    "Displacement",
    "Energy",
    "Force",
    "Friction",
    "In",
    "InputError",
    "Isotropic",
    "Model",
    "Moment",
    "NewtonStep",
    "On",
    "Orthotropic",
    "Pressure",
    "Scene",
    "Solution",
    "Superpotential",
    "Support",
    "Temperature",
    "Traction",
    "__version__",
    "check",
    "dump_scene",
    "equilibria",
    "follow",
    "laws",
    "prepare",
    "read_scene",
    "set_log_level",
    "solve",
    "study",
]

if TYPE_CHECKING:
    from . import laws
    from .errors import InputError
    from .laws import Superpotential
    from .modelling import (
        Adhesion,
        Anisotropic,
        Body,
        BodyForce,
        Cohesion,
        Contact,
        Displacement,
        Energy,
        Force,
        Friction,
        In,
        Isotropic,
        Model,
        Moment,
        On,
        Orthotropic,
        Pressure,
        Solution,
        Support,
        Temperature,
        Traction,
        check,
        equilibria,
        follow,
        solve,
        study,
    )
    from .runtime.log import NewtonStep, set_log_level
    from .runtime.versions import __version__
    from .scene import Scene, dump_scene, read_scene
    from .workflow import prepare


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    if name == "laws":
        return importlib.import_module(".laws", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f".{_HOME[name]}", __name__), name)
