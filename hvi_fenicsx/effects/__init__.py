"""The effects: importing the package registers those that come with the program."""

from ..class_registry import load_modules
from . import anisotropic, cohesion, contact, elasticity, friction, loads, normal_laws, thermal, total_loads
from .base import Drive, Effect, Evaluate, FormContext, Place, SideMoments, Sizes, SurfaceLoad, load_name
from .contribution import (
    Averaged,
    BoundaryLaw,
    Condition,
    Contribution,
    Direction,
    NormalBounds,
    ObstacleForce,
    ObstacleMove,
    Towards,
)
from .formula_field import FormulaField
from .role import Role, role_of

__all__ = [
    "Averaged",
    "BoundaryLaw",
    "Condition",
    "Contribution",
    "Direction",
    "Drive",
    "Effect",
    "Evaluate",
    "FormContext",
    "FormulaField",
    "NormalBounds",
    "ObstacleForce",
    "ObstacleMove",
    "Place",
    "Role",
    "SideMoments",
    "Sizes",
    "SurfaceLoad",
    "Towards",
    "anisotropic",
    "cohesion",
    "contact",
    "elasticity",
    "friction",
    "load_name",
    "loads",
    "normal_laws",
    "role_of",
    "thermal",
    "total_loads",
]

load_modules(__name__)
