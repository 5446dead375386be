"""Smoothings: from a law with kinks to one without, at a stated price (docs/laws.md)."""

from ...class_registry import load_modules
from .base import SmoothedLaw, Smoothing, available, create, registered
from .paper import PaperSmoothedLaw, PaperSmoothing
from .smoothed_law import QUADRATIC, Chks, LogExp, PlusFunction, PlusSmoothedLaw, Quadratic

load_modules(__name__)
