"""Smoothings: from a law with kinks to one without, at a stated price (docs/laws.md)."""

from ...class_registry import load_modules
from .base import SmoothedLaw, Smoothing, registered
from .paper import PaperSmoothedLaw, PaperSmoothing
from .plus_functions import QUADRATIC, Chks, LogExp, Quadratic
from .registry import available, create
from .smoothed_law import PlusFunction, PlusSmoothedLaw

__all__ = [
    "QUADRATIC",
    "Chks",
    "LogExp",
    "PaperSmoothedLaw",
    "PaperSmoothing",
    "PlusFunction",
    "PlusSmoothedLaw",
    "Quadratic",
    "SmoothedLaw",
    "Smoothing",
    "available",
    "create",
    "registered",
]

load_modules(__name__)
