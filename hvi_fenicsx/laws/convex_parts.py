"""The parts of a law: convex functions on the line, and those in other units."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from typing_extensions import override

from ..typing import Array, Integers


def quotient(a: Array, b: Array | float) -> Array:
    """The quotient a / b; NumPy's own types leave open that it is of doubles.

    Args:
        a: numerator (m,).
        b: denominator, (m,) or a number.
    """
    result: Array = np.divide(a, b)
    return result


def folded(low: Array, high: Array) -> tuple[Array, Array]:
    """The least and the largest |x| on intervals, (m,) each.

    Args:
        low: begin of the intervals, (m,).
        high: end of the intervals, (m,).
    """
    return np.maximum(np.maximum(low, -high), 0.0), np.maximum(np.abs(low), np.abs(high))


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

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Right and second derivative, (m,) each; a part whose two have terms in common computes these once.

        Args:
            x: arguments, (m,).
        """
        return self.right(x), self.second(x)

    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of the second derivative off the kinks on intervals, (m,) each; 0 and inf where none is known.

        Args:
            low: begin of the intervals, (m,).
            high: end of the intervals, (m,).
        """
        return np.zeros(np.shape(low)), np.full(np.shape(high), np.inf)

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

    @override
    def derivatives(self, x: Array) -> tuple[Array, Array]:
        right, second = self.part.derivatives(self._original(x))
        return quotient(right, self.traction), second * (self.length / self.traction)

    @override
    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        factor = self.length / self.traction
        least, most = self.part.second_range(self._original(low), self._original(high))
        return least * factor, most * factor

    def _original(self, x: Array) -> Array:
        """The displacement in the law's own unit, exact at kinks, which kink / length * length may miss."""
        original = x * self.length
        for kink, own in zip(self.kinks, self.part.kinks, strict=True):
            original = np.where(x == kink, own, original)
        return original


_FAR = 1e100
"""A displacement (m) beyond all that a law tells apart."""


class SplitLaw(ABC):
    """A law given by the derivatives of H and G, which never fall."""

    @property
    @abstractmethod
    def convex(self) -> ConvexPart:
        """H of the split j = H - G: the rising parts and upward jumps of the traction."""

    @property
    @abstractmethod
    def concave(self) -> ConvexPart:
        """G of the split j = H - G, convex as well: the falling parts and downward jumps of the traction."""

    @property
    @abstractmethod
    def growth(self) -> Directional:
        """j^∞(±1) = lim j(±t)/t for t → ∞, in N/m²: the residual resistance."""

    @property
    @abstractmethod
    def length_scale(self) -> float:
        """A displacement typical of the law, m: where its first kink off zero lies."""

    @cached_property
    def is_convex(self) -> bool:
        """Whether j is convex: the derivative of G, which never falls, is the same at both ends of the line."""
        with np.errstate(all="ignore"):
            low, high = self.concave.right(np.array([-_FAR, _FAR]))
        return bool(low == high)

    @cached_property
    def steepest_fall(self) -> float:
        """A bound from above of -j'', N/m³: 0 where j is convex, inf where the traction drops or no bound is known."""
        if self.is_convex or self.concave.kinks.size:
            return 0.0 if self.is_convex else np.inf
        ends = np.concatenate([[-np.inf], self.breaks, [np.inf]])
        with np.errstate(all="ignore"):
            falls = -self.slope_range(ends[:-1], ends[1:])[0]
        return np.inf if np.isnan(falls).any() else max(0.0, float(np.max(falls)))

    def left(self, x: Array) -> Array:
        """Left derivative of j at x (m,), N/m²."""
        return self.convex.left(x) - self.concave.left(x)

    def right(self, x: Array) -> Array:
        """Right derivative of j at x (m,), N/m²."""
        return self.convex.right(x) - self.concave.right(x)

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Right derivative of j at x (m,), N/m², and j'' off the kinks, N/m³.

        Args:
            x: displacements, (m,), m.
        """
        (rises, steeper), (falls, steep) = (part.derivatives(x) for part in (self.convex, self.concave))
        return rises - falls, steeper - steep

    def slope_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bounds of j'' off the kinks on intervals, N/m³, (m,) each; infinite where none is known.

        Args:
            low: begin of the intervals, (m,).
            high: end of the intervals, (m,).
        """
        rises, falls = (part.second_range(low, high) for part in (self.convex, self.concave))
        return rises[0] - falls[1], rises[1] - falls[0]

    @cached_property
    def kinks(self) -> Array:
        """Positions (k,), ascending, of all kinks of j."""
        return np.union1d(self.convex.kinks, self.concave.kinks)

    @property
    def breaks(self) -> Array:
        """Positions (k,), ascending, 0 among them, between which the traction is smooth."""
        return np.union1d(self.kinks, np.zeros(1))

    def interval(self, x: Array, atol: float | Array = 0.0) -> tuple[Array, Array]:
        """Clarke's subdifferential [lo, hi] of j, N/m², each (m,).

        Args:
            x: displacements (m,), m.
            atol: a length, or one for each displacement, m: the hull is taken with the intervals of every kink within
                it, so that a displacement which means a kink but misses it by rounding is given the kink's whole
                interval.
        """
        lo, hi = self._clarke(x)
        for kink in self._kinks_within(x, atol):
            near = np.abs(x - kink) <= atol
            low, high = self._clarke(np.array([kink]))
            lo = np.where(near, np.minimum(lo, low[0]), lo)
            hi = np.where(near, np.maximum(hi, high[0]), hi)
        return lo, hi

    def distance(self, x: Array, traction: Array, atol: float | Array = 0.0) -> Array:
        """Distance (m,) of a traction from ∂j(x), N/m²; zero if the law allows it.

        Args:
            x: displacements (m,), m.
            traction: (m,), N/m².
            atol: see `interval`.
        """
        lo, hi = self.interval(x, atol)
        return np.asarray(np.maximum(np.maximum(lo - traction, traction - hi), 0.0))

    def piece(self, x: Array) -> Integers:
        """Index (m,) of the law's piece that x lies on, counted from 0 by |x|; this default knows one."""
        return np.zeros(np.shape(x), dtype=np.int64)

    def branch(self, x: Array, atol: float | Array = 0.0) -> Integers:
        """Index (m,) of the active piece, counted from 0 by |x|; -1 on a kink.

        Args:
            x: displacements (m,), m.
            atol: the distance from a kink, or one for each displacement, m, that counts as being on it.
        """
        result = self.piece(x)
        for kink in self._kinks_within(x, atol):
            result = np.where(np.abs(x - kink) <= atol, -1, result)
        return result

    def _clarke(self, x: Array) -> tuple[Array, Array]:
        left, right = self.left(x), self.right(x)
        return np.minimum(left, right), np.maximum(left, right)

    def _kinks_within(self, x: Array, atol: float | Array) -> Array:
        if np.size(x) == 0:
            return np.empty(0)
        return self.kinks[(self.kinks >= np.min(x - atol)) & (self.kinks <= np.max(x + atol))]
