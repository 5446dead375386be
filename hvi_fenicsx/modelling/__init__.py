"""Models from Python: a body on any dolfinx mesh, effects on named places, solutions in SI (docs/python.md)."""

from .body import Body
from .following import ModelPath, follow
from .materials import Anisotropic, Energy, Isotropic, Orthotropic
from .model import Model
from .own_effects import In, On
from .placed_effects import (
    Adhesion,
    BodyForce,
    Cohesion,
    Contact,
    Displacement,
    Friction,
    PlacedEffect,
    Support,
    Temperature,
    Traction,
)
from .placed_loads import Force, Moment, Pressure
from .solution import ModelSolution as Solution
from .solving import check, solve
from .stationary import Equilibria, equilibria
from .studying import ModelStudy, study

__all__ = [
    "Adhesion",
    "Anisotropic",
    "Body",
    "BodyForce",
    "Cohesion",
    "Contact",
    "Displacement",
    "Energy",
    "Equilibria",
    "Force",
    "Friction",
    "In",
    "Isotropic",
    "Model",
    "ModelPath",
    "ModelStudy",
    "Moment",
    "On",
    "Orthotropic",
    "PlacedEffect",
    "Pressure",
    "Solution",
    "Support",
    "Temperature",
    "Traction",
    "check",
    "equilibria",
    "follow",
    "solve",
    "study",
]
