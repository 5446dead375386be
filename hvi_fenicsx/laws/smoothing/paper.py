"""The paper's own smoothing of its own law, faithfully (Ovcharova and Gwinner, section 5.2).

-j = max{g1, g2} with g1 = -γ1/(2δ) x², g2 = -γ2 |x| is replaced by S = g1 + p(d; ε), where d = g2 - g1 and
p is the quadratic plus function. Both pieces also meet at x = 0, so S acts there too, for every ε, however
small: the smoothed even law has a false kink at zero slip, where its subdifferential is [-γ2/2, γ2/2]. For
results as the paper's, use this; for results as the law's, a plus function.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np
from typing_extensions import override

from ...errors import InputError
from ...typing import Array
from ..base import Superpotential
from ..catalogue import QuadraticLinear
from ..convex_parts import ConvexPart, DifferentiablePart, folded
from .base import SmoothedLaw, Smoothing
from .smoothed_law import QUADRATIC


class PaperSmoothing(Smoothing):
    """The paper's S, for its quadratic-linear law."""

    name = "paper"
    laws = (QuadraticLinear.name,)

    @override
    def smooth(self, law: Superpotential, epsilon_absolute: float) -> PaperSmoothedLaw:
        if not isinstance(law, QuadraticLinear):
            raise InputError(
                f'smoothing = "paper" is defined for the law "quadratic_linear" only, not for '
                f'{law.name!r}; take "quadratic" (the same plus function), "chks" or "log_exp"'
            )
        return PaperSmoothedLaw(law, epsilon_absolute)


@dataclass(frozen=True)
class PaperSmoothedLaw(SmoothedLaw, register=False):
    """j ≈ -S(x, ε) for the quadratic-linear law, even, ε in N/m.

    Split: -S'' = s (1 - p'(d)) - d'² p''(d) with s = γ1/δ; G'' is the second term, H the rest, with the kink.
    """

    name = "paper_smoothing"
    law: QuadraticLinear

    @property
    @override
    def bound(self) -> float:
        """Bound of |S + j|, N/m: ε/8, attained at x = 0 and δ."""
        return QUADRATIC.kappa * self.epsilon_absolute

    @override
    def value(self, x: Array) -> Array:
        y, law = np.abs(x), self.law
        with np.errstate(over="ignore"):
            exact = np.minimum(0.5 * self.slope * y * y, law.gamma2 * y)
            z = np.abs(self.gap(y)) / self.epsilon_absolute
        return np.asarray(exact - self.epsilon_absolute * QUADRATIC.profile(z)[0])

    @cached_property
    @override
    def convex(self) -> ConvexPart:
        return _PaperConvex(self)

    @cached_property
    @override
    def concave(self) -> _PaperConcave:
        return _PaperConcave(self)

    @property
    @override
    def breaks(self) -> Array:
        ends = [band.kink + end for band in self.concave.bands for end in (band.low, band.high)]
        return np.union1d(ends, np.negative(ends))

    @property
    def slope(self) -> float:
        """The stiffness γ1/δ of the rising branch, N/m³."""
        return self.law.gamma1 / self.law.delta

    def gap(self, y: Array) -> Array:
        """The difference d = g2 - g1 at slips y ≥ 0, in N/m; inf where beyond the largest float."""
        with np.errstate(over="ignore"):
            return 0.5 * self.slope * y * (y - self.law.delta)

    def share(self, y: Array) -> Array:
        """p'(d) at slips y ≥ 0: how far the law has passed to its second piece, from 0 to 1."""
        return QUADRATIC.derivative(self.gap(y), self.epsilon_absolute)

    def traction(self, y: Array) -> Array:
        """Right derivative at slips y ≥ 0, in N/m²: γ2/2 at 0."""
        share = self.share(y)
        with np.errstate(over="ignore"):
            rising = np.where(share < 1.0, (1.0 - share) * self.slope * y, 0.0)
        return rising + share * self.law.gamma2

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        law = QuadraticLinear(self.law.gamma1 / traction, self.law.gamma2 / traction, self.law.delta / length)
        return PaperSmoothedLaw(law, self.epsilon_absolute / (length * traction))


@dataclass(frozen=True, eq=False)
class _Band:
    """An interval of slips with |d| ≤ ε/2, as offsets from its kink; there G'' = s² (y - δ/2)²/ε.

    Offsets, because at small ε the band is narrower than the rounding of its ends.
    """

    kink: float
    low: float
    high: float
    middle: float

    def integrals(self, y: Array) -> tuple[Array, Array]:
        """∫∫ and ∫ of (y - δ/2)² over the part of the band below y."""
        start = (self.kink - self.middle) + self.low
        t = y - self.kink
        h = np.minimum(np.maximum(t, self.low), self.high) - self.low
        once = h * (start * start + start * h + h * h / 3.0)
        twice = h * h * (0.5 * start * start + start * h / 3.0 + h * h / 12.0)
        return twice + once * np.maximum(t - self.high, 0.0), once


@dataclass(frozen=True, eq=False)
class _PaperConcave(DifferentiablePart):
    """G: even, smooth, with the second derivative d'² p''(d)."""

    law: PaperSmoothedLaw

    @cached_property
    def bands(self) -> tuple[_Band, _Band]:
        """Around 0 (its half y ≥ 0) and around δ. |y - δ/2| runs from w1 to w2 where |d| ≤ ε/2."""
        middle, width = 0.5 * self.law.law.delta, self.law.epsilon_absolute / self.law.slope
        w1, w2 = sqrt(max(middle * middle - width, 0.0)), sqrt(middle * middle + width)
        inner = min(width / (middle + w1), middle)
        return (
            _Band(0.0, 0.0, inner, middle),
            _Band(self.law.law.delta, -inner, width / (middle + w2), middle),
        )

    def _integrals(self, x: Array) -> tuple[Array, Array]:
        factor = self.law.slope * (self.law.slope / self.law.epsilon_absolute)
        near, far = (band.integrals(np.abs(x)) for band in self.bands)
        return factor * (near[0] + far[0]), factor * (near[1] + far[1])

    @override
    def value(self, x: Array) -> Array:
        return self._integrals(x)[0]

    @override
    def right(self, x: Array) -> Array:
        return np.asarray(np.sign(x) * self._integrals(x)[1])

    @override
    def second(self, x: Array) -> Array:
        y, s, law = np.abs(x), self.law.slope, self.law.law
        inside = np.abs(self.law.gap(y)) < 0.5 * self.law.epsilon_absolute
        rate = np.where(inside, s * y - law.gamma2, 0.0)
        return rate * (rate / self.law.epsilon_absolute)

    @override
    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        near, far = folded(low, high)
        least, most = np.full(near.shape, np.inf), np.zeros(near.shape)
        for band in self.bands:
            ends = band.kink + band.low, band.kink + band.high
            rates = self.law.slope * (np.stack([np.maximum(near, ends[0]), np.minimum(far, ends[1])]) - band.middle)
            meets, within = (near <= ends[1]) & (far >= ends[0]), (near >= ends[0]) & (far <= ends[1])
            size = folded(*rates)
            least = np.where(within, size[0] * (size[0] / self.law.epsilon_absolute), least)
            most = np.where(meets, np.maximum(most, size[1] * (size[1] / self.law.epsilon_absolute)), most)
        return np.where(np.isfinite(least), least, 0.0), most


@dataclass(frozen=True, eq=False)
class _PaperConvex(ConvexPart):
    """H = -S + G: even, with the second derivative s (1 - p'(d)) and the false kink of height γ2 at 0."""

    law: PaperSmoothedLaw

    @property
    @override
    def kinks(self) -> Array:
        return np.zeros(1)

    @override
    def value(self, x: Array) -> Array:
        return self.law.value(x) + self.law.concave.value(x)

    @override
    def left(self, x: Array) -> Array:
        return -self.right(-x)

    @override
    def right(self, x: Array) -> Array:
        y = np.abs(x)
        return np.where(x >= 0.0, 1.0, -1.0) * (self.law.traction(y) + self.law.concave.right(y))

    @override
    def second(self, x: Array) -> Array:
        return self.law.slope * (1.0 - self.law.share(np.abs(x)))

    @override
    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        near, far = folded(low, high)
        turn = np.clip(0.5 * self.law.law.delta, near, far)
        shares = np.stack([self.law.share(y) for y in (near, turn, far)])
        return self.law.slope * (1.0 - shares.max(axis=0)), self.law.slope * (1.0 - shares.min(axis=0))
