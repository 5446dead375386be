"""The box of effects: importing it registers those that come with the program."""

from . import contact, elasticity, friction, loads, normal
from .base import Effect, Place

__all__ = ["Effect", "Place", "contact", "elasticity", "friction", "loads", "normal"]
