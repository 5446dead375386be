"""A piece of a law's energy: a parabola on an interval."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

from ..typing import Array

Place = TypeVar("Place", float, Array)


class Arc(NamedTuple):
    """The parabola value + traction (x - anchor) + ½ slope (x - anchor)² on low ≤ x ≤ high."""

    low: float
    high: float
    anchor: float
    value: float
    traction: float
    slope: float

    def at(self, x: Place) -> Place:
        """The value at x."""
        d = x - self.anchor
        return self.value + (self.traction + 0.5 * self.slope * d) * d

    def rate(self, x: Place) -> Place:
        """The derivative at x."""
        return self.traction + self.slope * (x - self.anchor)

    def moved(self, d: float) -> Arc:
        """The arc with ½ d x² added."""
        a = self.anchor
        return Arc(self.low, self.high, a, self.value + 0.5 * d * a * a, self.traction + d * a, self.slope + d)
