"""The box of effects: importing it registers those that come with the program."""

from . import contact, elasticity, loads
from .base import Effect, Place

__all__ = ["Effect", "Place", "contact", "elasticity", "loads"]
