"""The box of effects: importing it registers those that come with the program."""

from . import anisotropic, contact, elasticity, friction, loads, normal, thermal
from .base import Effect, Place

__all__ = ["Effect", "Place", "anisotropic", "contact", "elasticity", "friction", "loads", "normal", "thermal"]
