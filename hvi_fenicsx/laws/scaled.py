"""Any law in other units: the default of `Superpotential.scaled`, so that users' laws need not define it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from typing_extensions import override

from ..typing import Array, Integers
from .base import ConvexPart, Directional, Superpotential, quotient
from .parameter_checks import require_positive


@dataclass(frozen=True, eq=False)
class ScaledPart(ConvexPart):
    """f(length x) / (length traction) for a convex part f."""

    part: ConvexPart
    length: float
    traction: float

    @override
    @cached_property
    def kinks(self) -> Array:
        return quotient(self.part.kinks, self.length)

    @override
    def value(self, x: Array) -> Array:
        return quotient(self.part.value(x * self.length), self.length * self.traction)

    @override
    def left(self, x: Array) -> Array:
        return quotient(self.part.left(self._original(x)), self.traction)

    @override
    def right(self, x: Array) -> Array:
        return quotient(self.part.right(self._original(x)), self.traction)

    @override
    def second(self, x: Array) -> Array:
        return self.part.second(self._original(x)) * (self.length / self.traction)

    def _original(self, x: Array) -> Array:
        """The displacement in the law's own unit, exact at kinks, which kink / length * length may miss."""
        original = x * self.length
        for kink, own in zip(self.kinks, self.part.kinks, strict=True):
            original = np.where(x == kink, own, original)
        return original


@dataclass(frozen=True)
class ScaledLaw(Superpotential, register=False):
    """A law with displacements measured in `length` and tractions in `traction`."""

    name = "scaled"
    law: Superpotential
    length: float
    traction: float

    def __post_init__(self) -> None:
        require_positive(self.name, length=self.length, traction=self.traction)

    @override
    def value(self, x: Array) -> Array:
        return quotient(self.law.value(x * self.length), self.length * self.traction)

    @override
    @cached_property
    def convex(self) -> ConvexPart:
        return ScaledPart(self.law.convex, self.length, self.traction)

    @override
    @cached_property
    def concave(self) -> ConvexPart:
        return ScaledPart(self.law.concave, self.length, self.traction)

    @override
    @property
    def growth(self) -> Directional:
        return Directional(self.law.growth.minus / self.traction, self.law.growth.plus / self.traction)

    @override
    @property
    def peak(self) -> Directional:
        return Directional(self.law.peak.minus / self.traction, self.law.peak.plus / self.traction)

    @override
    @property
    def energy_scale(self) -> float:
        return self.law.energy_scale / (self.length * self.traction)

    @override
    @property
    def length_scale(self) -> float:
        return self.law.length_scale / self.length

    @override
    @property
    def even(self) -> bool:
        return self.law.even

    @override
    @property
    def is_linear(self) -> bool:
        return self.law.is_linear

    @override
    def piece(self, x: Array) -> Integers:
        return self.law.piece(x * self.length)

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        return ScaledLaw(self.law, self.length * length, self.traction * traction)
