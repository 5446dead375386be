"""A law with its kinks smoothed, and nothing else changed.

A jump c of the traction at a is a summand c (x - a)₊ of j. Replacing (x - a)₊ by p(x - a; ε/|c|) adds
sign(c) ε D(|c| |x - a|/ε): up to κ ε, an energy per area, whatever the jump. Upward jumps are those of H,
downward ones those of G, so H + ε ΣD and G + ε ΣD are convex again: the smoothed law's own split.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from typing_extensions import override

from ...typing import Array, Integers
from ..base import ConvexPart, DifferentiablePart, Directional, Superpotential
from .checks import require_epsilon
from .plus_functions import QUADRATIC, PlusFunction

_LARGEST = float(np.finfo(np.float64).max)


@dataclass(frozen=True, eq=False)
class SmoothedPart(DifferentiablePart):
    """A convex part with every kink replaced by the plus function of width ε/jump.

    Of an even part (the split of an even law) only x ≥ 0 is computed, so that it is even to the bit.
    """

    part: ConvexPart
    plus: PlusFunction
    epsilon: float
    even: bool

    @override
    def value(self, x: Array) -> Array:
        return self.part.value(x) + self.correction(x)

    @override
    def right(self, x: Array) -> Array:
        folded, sign = self._fold(x)
        _, slopes, _ = self._profiles(folded)
        # Right of a kink the plus function's slope is 1 + D', left of it -D'; the 1 is the part's own jump.
        turned = np.where(folded[:, None] >= self._places, slopes, -slopes)
        return np.asarray(sign * (self.part.right(folded) + turned @ self._heights))

    @override
    def second(self, x: Array) -> Array:
        folded, _ = self._fold(x)
        _, _, curvatures = self._profiles(folded)
        with np.errstate(over="ignore"):
            stiffness = np.minimum(self._heights / self.epsilon * self._heights, _LARGEST)
            return np.asarray(self.part.second(folded) + (curvatures * stiffness).sum(axis=1))

    def correction(self, x: Array) -> Array:
        """What the smoothing adds to the part, from 0 to κ ε for each kink."""
        values, _, _ = self._profiles(self._fold(x)[0])
        return np.asarray(self.epsilon * values.sum(axis=1))

    def _fold(self, x: Array) -> tuple[Array, Array]:
        return (np.abs(x), np.sign(x)) if self.even else (x, np.ones_like(x))

    @cached_property
    def _places(self) -> Array:
        return self.part.kinks

    @cached_property
    def _heights(self) -> Array:
        return self.part.jumps

    def _profiles(self, x: Array) -> tuple[Array, Array, Array]:
        """D, D', D'' (m, k) of each point and kink, at their distance in units of the kink's width ε/jump."""
        with np.errstate(over="ignore"):
            return self.plus.profile(np.abs(x[:, None] - self._places) / self.epsilon * self._heights)


@dataclass(frozen=True)
class Smoothing(Superpotential, register=False):
    """A law smoothed with a width ε (N/m): what all smoothings leave as the law has it."""

    law: Superpotential
    epsilon_absolute: float

    def __post_init__(self) -> None:
        require_epsilon("epsilon_absolute", self.epsilon_absolute)

    @property
    def epsilon(self) -> float:
        """ε relative to the law's energy scale."""
        return self.epsilon_absolute / self.law.energy_scale

    @property
    @override
    def growth(self) -> Directional:
        return self.law.growth

    @property
    @override
    def energy_scale(self) -> float:
        return self.law.energy_scale

    @property
    @override
    def length_scale(self) -> float:
        return self.law.length_scale

    @property
    @override
    def even(self) -> bool:
        return self.law.even

    @override
    def piece(self, x: Array) -> Integers:
        return self.law.piece(x)


@dataclass(frozen=True)
class SmoothedLaw(Smoothing, register=False):
    """A law smoothed at its kinks by one plus function, with ε (N/m) the same for every kink.

    An even law stays even, with traction exactly 0 at zero slip; a kink at zero slip is smoothed like any.
    The scales are those of the law. `peak`, `c3`, `c4` are bounds from above, sharp to a relative 1e-6.
    """

    name = "smoothed"
    plus: PlusFunction = QUADRATIC

    @classmethod
    def relative(cls, law: Superpotential, epsilon: float, plus: PlusFunction = QUADRATIC) -> SmoothedLaw:
        """With ε = epsilon times the law's energy scale."""
        require_epsilon("epsilon", epsilon)
        return cls(law, epsilon * law.energy_scale, plus)

    @property
    def bound(self) -> float:
        """Bound of |S - j|, N/m: κ ε times the number of upward or of downward jumps, whichever is larger.

        Upward ones only raise the energy and downward ones only lower it, so the two do not add.
        """
        kinks = max(self.law.convex.kinks.size, self.law.concave.kinks.size)
        return self.plus.kappa * self.epsilon_absolute * kinks

    @override
    def value(self, x: Array) -> Array:
        # From the law itself, not H - G: at large x that would be a difference of large numbers.
        return self.law.value(x) + (self._smooth_convex.correction(x) - self._smooth_concave.correction(x))

    @property
    @override
    def convex(self) -> ConvexPart:
        return self._smooth_convex

    @property
    @override
    def concave(self) -> ConvexPart:
        return self._smooth_concave

    @cached_property
    def _smooth_convex(self) -> SmoothedPart:
        return SmoothedPart(self.law.convex, self.plus, self.epsilon_absolute, self.law.even)

    @cached_property
    def _smooth_concave(self) -> SmoothedPart:
        return SmoothedPart(self.law.concave, self.plus, self.epsilon_absolute, self.law.even)

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        return SmoothedLaw(self.law.scaled(length, traction), self.epsilon_absolute / (length * traction), self.plus)
