"""Nonmonotone laws: superpotentials as objects, the catalogue, and base classes of your own laws (docs/laws.md)."""

from ..class_registry import load_modules
from .base import ConvexPart, DifferentiablePart, Directional, Superpotential
from .catalogue import (
    Exponential,
    Graph,
    LinearSpring,
    QuadraticLinear,
    QuadraticLinearLiteral,
    Sawtooth,
    Tresca,
    WeakeningLaw,
)
from .lengths import BenzeggaghKenane, Length, Mixity, PowerLaw, mixities
from .polyline import PolylineLaw, PolylinePart, SampledLaw
from .registry import available, create, describe
from .traction_graph import TractionGraph
from .vertex_laws import VertexLaws

load_modules(__name__)
