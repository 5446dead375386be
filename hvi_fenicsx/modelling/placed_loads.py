"""Loads that are stated for a whole side: its pressure, the force on it, the moment about its centroid."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from dolfinx import mesh as dmesh

from ..effects import Effect, total_loads
from ..errors import InputError
from ..schema import shown
from . import values
from .placed_effects import OnSide, Value, checked


@dataclass(frozen=True)
class Pressure(OnSide):
    """A pressure against the side.

    Attributes:
        side: the side's name, or a list of sides.
        value: N/m²; negative: suction.
    """

    side: str | Sequence[str]
    value: Value

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        return checked(total_loads.Pressure, value=values.spatial_value(self.value, mesh))


@dataclass(frozen=True)
class Force(OnSide):
    """A force on the whole side, spread evenly over it.

    Attributes:
        side: the side's name, or a list of sides.
        values: N (N/m in 2D), by component.
    """

    side: str | Sequence[str]
    values: Sequence[float]

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        return checked(total_loads.TotalForce, values=values.numbers(self.values))


@dataclass(frozen=True)
class Moment(OnSide):
    """A moment on the whole side about its centroid, by tractions as in a bent or twisted beam.

    Attributes:
        side: the side's name, or a list of sides.
        value: N m (N in 2D): a number about z in 2D, three components in 3D.
    """

    side: str | Sequence[str]
    value: float | Sequence[float]

    def effect(self, mesh: dmesh.Mesh) -> Effect:
        """The load."""
        given = values.numbers(self.value)
        listed = given if isinstance(given, tuple) else (values.number(given),)
        if not all(isinstance(one, float) and math.isfinite(one) for one in listed):
            raise InputError(f"value: must be a finite number, in 3D a list of three (is {shown(self.value)})")
        return checked(total_loads.Moment, values=listed)
