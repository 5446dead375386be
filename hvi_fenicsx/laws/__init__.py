"""Nonmonotone laws: superpotentials as objects, the catalogue, and base classes of your own laws (docs/laws.md)."""

from ..class_registry import load_modules
from .base import Superpotential
from .catalogue import Graph, LinearSpring, QuadraticLinear, QuadraticLinearLiteral, Sawtooth, Tresca
from .convex_parts import ConvexPart, DifferentiablePart, Directional
from .lengths import BenzeggaghKenane, Length, Mixity, PowerLaw, mixities
from .polyline import PolylineLaw, PolylinePart, SampledLaw, sample_traction
from .registry import available, create, describe
from .traction_bounds import LawThresholds
from .traction_graph import TractionGraph
from .vertex_laws import VertexLaws
from .weakening import Exponential, WeakeningLaw

__all__ = [
    "BenzeggaghKenane",
    "ConvexPart",
    "DifferentiablePart",
    "Directional",
    "Exponential",
    "Graph",
    "LawThresholds",
    "Length",
    "LinearSpring",
    "Mixity",
    "PolylineLaw",
    "PolylinePart",
    "PowerLaw",
    "QuadraticLinear",
    "QuadraticLinearLiteral",
    "SampledLaw",
    "Sawtooth",
    "Superpotential",
    "TractionGraph",
    "Tresca",
    "VertexLaws",
    "WeakeningLaw",
    "available",
    "create",
    "describe",
    "mixities",
    "sample_traction",
]

load_modules(__name__)


def __dir__() -> list[str]:
    return __all__
