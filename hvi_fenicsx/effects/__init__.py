"""The effects: what may act on a body, and where. A new one is a new class, known by its key once it is defined."""

from ..class_registry import load_modules
from .base import (
    BodySizes,
    Drive,
    Effect,
    Evaluate,
    FormContext,
    Place,
    SideMoments,
    Sides,
    SurfaceLoad,
    from_python,
    in_words,
    load_name,
    names_in_python,
)
from .contact import Contact
from .contribution import (
    Averaged,
    BoundaryLaw,
    Condition,
    Contribution,
    Direction,
    NormalBounds,
    ObstacleMotion,
    Towards,
)
from .elasticity import Anisotropic, Isotropic, Orthotropic
from .law_effects import Adhesion, Cohesion, Friction, LawEffect, Support
from .loads import BodyForce, Displacement, Force, Moment, Pressure, Temperature, Traction
from .values import FormulaField

load_modules(__name__)
