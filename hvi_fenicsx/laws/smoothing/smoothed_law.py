"""Smoothing by a plus function: the kinks of a law are smoothed, and nothing else is changed.

A plus function is p(t; e) = max(t, 0) + e D(|t|/e) with one profile D: convex, decreasing, D(0) = κ, D'(0) = -1/2. So
the error is at most κ e, largest at the kink and alike on both sides of it, and as D decays, so does the error away
from the kink. Computing D, and not p, keeps the difference p - max(t, 0) exact where it is tiny.

A jump c of the traction at a is a summand c (x - a)₊ of j. Replacing (x - a)₊ by p(x - a; ε/|c|) adds
sign(c) ε D(|c| |x - a|/ε): up to κ ε, an energy per area, whatever the jump. Upward jumps are those of H,
downward ones those of G, so H + ε ΣD and G + ε ΣD are convex again: the smoothed law's own split.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from typing_extensions import override

from ...typing import Array
from ..base import Superpotential
from ..convex_parts import ConvexPart, DifferentiablePart, folded, quotient
from ..traction_graph import TractionGraph
from .base import SmoothedLaw, Smoothing

_LARGEST = float(np.finfo(np.float64).max)

Profiles = tuple[Array, Array, Array]
"""D, D' and D'', of one shape."""


@dataclass(frozen=True, eq=False)
class RoundedKinks:
    """What plus functions of the widths ε/|jump| add at the kinks of a function.

    Attributes:
        places: of the kinks, (k,).
        jumps: of the derivative there, positive or negative, (k,).
        profile: D, D' and D'' of the plus function at z = |t|/e ≥ 0.
        epsilon: ε.
    """

    places: Array
    jumps: Array
    profile: Callable[[Array], Profiles]
    epsilon: float

    def less(self, other: RoundedKinks) -> RoundedKinks:
        """What is added here less what is added at other kinks.

        Args:
            other: those.
        """
        jumps = np.concatenate([self.jumps, -other.jumps])
        return RoundedKinks(np.concatenate([self.places, other.places]), jumps, self.profile, self.epsilon)

    @cached_property
    def _heights(self) -> Array:
        return np.abs(self.jumps)

    @cached_property
    def _stiffness(self) -> Array:
        """By what D'' is multiplied at each kink, (k,)."""
        with np.errstate(over="ignore"):
            return np.sign(self.jumps) * np.minimum(self._heights / self.epsilon * self._heights, _LARGEST)

    def profiles(self, x: Array) -> Profiles:
        """D, D', D'' (m, k) of each point and kink, at their distance in units of the kink's width.

        Args:
            x: points, (m,).
        """
        return self._profiles(np.abs(x[:, None] - self.places))

    def _profiles(self, distances: Array) -> Profiles:
        with np.errstate(over="ignore"):
            return self.profile(distances / self.epsilon * self._heights)

    def values(self, profiles: Profiles) -> Array:
        """What is added to the function, (m,).

        Args:
            profiles: of the points.
        """
        return np.asarray(self.epsilon * (profiles[0] * np.sign(self.jumps)).sum(axis=1))

    def slopes(self, x: Array, profiles: Profiles) -> Array:
        """What is added to the right derivative, (m,).

        Args:
            x: points, (m,).
            profiles: of them.
        """
        # Right of a kink the plus function's slope is 1 + D', left of it -D'; the 1 is the function's own jump.
        turned = np.where(x[:, None] >= self.places, profiles[1], -profiles[1])
        return np.asarray(turned @ self.jumps)

    def curvatures(self, profiles: Profiles) -> Array:
        """What is added to the second derivative, (m,).

        Args:
            profiles: of the points.
        """
        with np.errstate(over="ignore"):
            return np.asarray((profiles[2] * self._stiffness).sum(axis=1))

    def curvature_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the largest of these on intervals, where D'' never rises and all jumps are positive, (m,) each.

        Args:
            low: begin of the intervals, (m,).
            high: end of the intervals, (m,).
        """
        near, far = folded(low[:, None] - self.places, high[:, None] - self.places)
        return self.curvatures(self._profiles(far)), self.curvatures(self._profiles(near))


@dataclass(frozen=True)
class PlusFunction(Smoothing):
    """One smoothing of max(t, 0), and of laws by it: a subclass gives a name, κ and the profile.

    Class attributes:
        kappa: the constant of |p(t; e) - max(t, 0)| ≤ κ e; it is attained at t = 0.
        bands: distances |t|/e between which D changes little in shape; beyond the last one it is next to nothing.
        unimodal: whether D'' never rises with the distance, so that its values at two distances bound it between.
        parabolic: whether D is a parabola up to the only band, and zero beyond it.
    """

    kappa: ClassVar[float]
    bands: ClassVar[tuple[float, ...]] = (1.0, 4.0, 16.0, 64.0)
    unimodal: ClassVar[bool] = False
    parabolic: ClassVar[bool] = False

    @abstractmethod
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        """D, D' and D'' at z = |t|/e ≥ 0, inf included; each of shape (m,)."""

    @override
    def smooth(self, law: Superpotential, epsilon_absolute: float) -> PlusSmoothedLaw:
        return PlusSmoothedLaw(law, epsilon_absolute, self)

    def derivative(self, t: Array, e: float) -> Array:
        """The derivative of p(t; e) by t, (m,): from 0 to 1, and 1/2 at 0.

        Args:
            t: arguments (m,).
            e: width > 0 in the unit of t.
        """
        with np.errstate(over="ignore"):
            slope = self.profile(np.abs(t) / e)[1]
        return np.where(t >= 0.0, 1.0 + slope, -slope)


def _fold(x: Array, *, even: bool) -> tuple[Array, Array]:
    """Where an even function is evaluated, and the sign of its derivative, (m,) each."""
    return (np.abs(x), np.sign(x)) if even else (x, np.ones_like(x))


@dataclass(frozen=True, eq=False)
class SmoothedPart(DifferentiablePart):
    """A convex part with every kink replaced by the plus function of width ε/jump.

    Of an even part (the split of an even law) only x ≥ 0 is computed, so that it is even to the bit.
    """

    part: ConvexPart
    plus: PlusFunction
    epsilon: float
    even: bool

    @cached_property
    def rounded(self) -> RoundedKinks:
        """Its kinks."""
        return RoundedKinks(self.part.kinks, self.part.jumps, self.plus.profile, self.epsilon)

    @override
    def value(self, x: Array) -> Array:
        return self.part.value(x) + self.correction(x)

    @override
    def right(self, x: Array) -> Array:
        x, sign = _fold(x, even=self.even)
        return sign * (self.part.right(x) + self.rounded.slopes(x, self.rounded.profiles(x)))

    @override
    def second(self, x: Array) -> Array:
        x, _ = _fold(x, even=self.even)
        return self.part.second(x) + self.rounded.curvatures(self.rounded.profiles(x))

    @override
    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        if not self.plus.unimodal:
            return super().second_range(low, high)
        if self.even:
            low, high = folded(low, high)
        least, most = self.part.second_range(low, high)
        more, most_more = self.rounded.curvature_range(low, high)
        with np.errstate(over="ignore"):
            return least + more, most + most_more

    def correction(self, x: Array) -> Array:
        """What the smoothing adds to the part, from 0 to κ ε for each kink."""
        return self.rounded.values(self.rounded.profiles(_fold(x, even=self.even)[0]))


@dataclass(frozen=True)
class PlusSmoothedLaw(SmoothedLaw, register=False):
    """A law smoothed at its kinks by one plus function, with ε (N/m) the same for every kink.

    An even law stays even, with traction exactly 0 at zero slip; a kink at zero slip is smoothed like any.
    The scales are those of the law. `peak` and `c4` are bounds from above, sharp to a relative 1e-6.
    """

    name = "smoothed"
    plus: PlusFunction

    @property
    @override
    def bound(self) -> float:
        """Bound of |S - j|, N/m: κ ε times the number of upward or of downward jumps, whichever is larger.

        Upward ones only raise the energy and downward ones only lower it, so the two do not add.
        """
        kinks = max(self.law.convex.kinks.size, self.law.concave.kinks.size)
        return self.plus.kappa * self.epsilon_absolute * kinks

    @override
    @cached_property
    def breaks(self) -> Array:
        ends = self.law.breaks
        for part in (self.law.convex, self.law.concave):
            widths = np.outer(self.epsilon_absolute / part.jumps, self.plus.bands)
            places = part.kinks[:, None]
            ends = np.union1d(ends, np.concatenate([places - widths, places + widths, places], axis=1))
        return ends

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

    @override
    @cached_property
    def graph(self) -> TractionGraph | None:
        if not (self.plus.parabolic and self.law.graph is not None):
            return None
        ends, tails = self.breaks, self.law.graph.slopes
        return TractionGraph.chords(ends, self.left(ends), self.right(ends), (float(tails[0]), float(tails[-1])))

    @cached_property
    @override
    def steepest_fall(self) -> float:
        if self.graph is not None:
            return max(0.0, -float(np.min(self.graph.slopes)))
        return min(self.law.steepest_fall, super().steepest_fall)  # what smooths an upward jump rises

    @override
    def derivatives(self, x: Array) -> tuple[Array, Array]:
        # From the law itself, and at the kinks of both parts at once.
        x, sign = _fold(x, even=self.even)
        profiles, (traction, slope) = self._rounded.profiles(x), self.law.derivatives(x)
        return sign * (traction + self._rounded.slopes(x, profiles)), slope + self._rounded.curvatures(profiles)

    @cached_property
    def _rounded(self) -> RoundedKinks:
        return self._smooth_convex.rounded.less(self._smooth_concave.rounded)

    @cached_property
    def _smooth_convex(self) -> SmoothedPart:
        return self._smoothed(self.law.convex)

    @cached_property
    def _smooth_concave(self) -> SmoothedPart:
        return self._smoothed(self.law.concave)

    def _smoothed(self, part: ConvexPart) -> SmoothedPart:
        return SmoothedPart(part, self.plus, self.epsilon_absolute, self.law.even)

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        return PlusSmoothedLaw(
            self.law.scaled(length, traction), self.epsilon_absolute / (length * traction), self.plus
        )


@dataclass(frozen=True)
class Quadratic(PlusFunction):
    """Zang's: 0 for t ≤ -e/2, (t + e/2)²/(2e) between, t for t ≥ e/2. The paper's, and the default.

    The difference from max(t, 0) is zero for |t| ≥ e/2.
    """

    name = "quadratic"
    kappa = 1.0 / 8.0
    bands = (0.5,)
    unimodal = True
    parabolic = True

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        rest = np.maximum(0.5 - z, 0.0)
        return 0.5 * rest**2, -rest, np.where(z < 0.5, 1.0, 0.0)


@dataclass(frozen=True)
class Chks(PlusFunction):
    """Chen, Harker, Kanzow, Smale: (t + √(t² + 4e²))/2. Smooth of every order.

    The difference from max(t, 0) is at most e²/|t|.
    """

    name = "chks"
    kappa = 1.0
    unimodal = True

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        root = np.hypot(z, 2.0)
        # (√(z² + 4) - z)/2 and its derivative, written without the difference of near equals.
        difference = quotient(np.full_like(z, 2.0), root + z)
        return difference, -difference / root, 2.0 / root**3


@dataclass(frozen=True)
class LogExp(PlusFunction):
    """e log(1 + exp(t/e)), the neural networks' softplus. Smooth of every order.

    The difference from max(t, 0) is at most e exp(-|t|/e).
    """

    name = "log_exp"
    kappa = math.log(2.0)
    bands = (2.0, 8.0, 32.0)
    unimodal = True

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        small = np.exp(-z)
        share = small / (1.0 + small)
        return np.log1p(small), -share, share / (1.0 + small)


QUADRATIC = Quadratic()
