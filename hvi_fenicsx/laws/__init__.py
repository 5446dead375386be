"""Nonmonotone laws: superpotentials as objects, the catalogue, and base classes of your own laws (docs/laws.md)."""

from ..class_registry import load_modules
from .base import Superpotential
from .catalogue import Graph, LinearSpring, QuadraticLinear, QuadraticLinearLiteral, Sawtooth, Tresca
from .convex_parts import ConvexPart, DifferentiablePart, Directional
from .lengths import Length
from .polyline import PolylineLaw, PolylinePart
from .registry import available, create, describe
from .sampled import SampledLaw, sample_traction
from .thresholds import Thresholds
from .traction_graph import TractionGraph
from .weakening import Exponential, WeakeningLaw

__all__ = [
    "ConvexPart",
    "DifferentiablePart",
    "Directional",
    "Exponential",
    "Graph",
    "Length",
    "LinearSpring",
    "PolylineLaw",
    "PolylinePart",
    "QuadraticLinear",
    "QuadraticLinearLiteral",
    "SampledLaw",
    "Sawtooth",
    "Superpotential",
    "Thresholds",
    "TractionGraph",
    "Tresca",
    "WeakeningLaw",
    "available",
    "create",
    "describe",
    "sample_traction",
]

load_modules(__name__)
