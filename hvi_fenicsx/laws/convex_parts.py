"""The parts of a law: convex functions on the line, and those in other units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from typing_extensions import override

from ..typing import Array


def quotient(a: Array, b: Array | float) -> Array:
    """The quotient a / b; NumPy's own types leave open that it is of doubles.

    Args:
        a: numerator (m,).
        b: denominator, (m,) or a number.
    """
    result: Array = np.divide(a, b)
    return result


@dataclass(frozen=True)
class Directional:
    """A positively homogeneous function on the line, by its values in two directions; they may be infinite.

    Attributes:
        minus: in the direction -1.
        plus: in the direction +1.
    """

    minus: float
    plus: float

    def times(self, factor: float) -> Directional:
        """The function multiplied by a positive number."""
        return Directional(self.minus * factor, self.plus * factor)


class ConvexPart(ABC):
    """A convex function on the line; H or G of a law's split j = H - G. Arrays in and out have shape (m,)."""

    @property
    @abstractmethod
    def kinks(self) -> Array:
        """Positions (k,), ascending, at which the derivative jumps upwards."""

    @abstractmethod
    def value(self, x: Array) -> Array:
        """The function."""

    @abstractmethod
    def left(self, x: Array) -> Array:
        """Left derivative, nondecreasing."""

    @abstractmethod
    def right(self, x: Array) -> Array:
        """Right derivative, nondecreasing; equals `left` off the kinks."""

    @abstractmethod
    def second(self, x: Array) -> Array:
        """Second derivative off the kinks; the larger one-sided one where the derivative's slope breaks."""

    @property
    def jumps(self) -> Array:
        """Heights (k,) of the jumps of the derivative at the kinks, all positive."""
        return self.right(self.kinks) - self.left(self.kinks)


class DifferentiablePart(ConvexPart):
    """A convex function without kinks: a subclass gives `value`, `right` and `second`."""

    @property
    @override
    def kinks(self) -> Array:
        return np.empty(0)

    @override
    def left(self, x: Array) -> Array:
        return self.right(x)


@dataclass(frozen=True, eq=False)
class ScaledPart(ConvexPart):
    """A convex part f in other units: f(length x) / (length traction).

    Attributes:
        part: f.
        length: the unit of displacements.
        traction: the unit of tractions.
    """

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
