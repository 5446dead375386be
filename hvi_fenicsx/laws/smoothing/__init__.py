"""Smoothings: from a law with kinks to one without, at a stated price (docs/laws.md)."""

from ...class_registry import load_modules
from .base import SmoothedLaw, Smoothing, available, create, registered
from .paper import PaperSmoothedLaw, PaperSmoothing
from .smoothed_law import QUADRATIC, Chks, LogExp, PlusFunction, PlusSmoothedLaw, Quadratic

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
