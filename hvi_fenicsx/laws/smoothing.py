"""Smoothings: from a law with kinks to one without, at a stated price.

By a plus function the kinks of a law are smoothed, and nothing else is changed. A plus function is p(t; e) =
max(t, 0) + e D(|t|/e) with one profile D: convex, decreasing, D(0) = κ, D'(0) = -1/2. So the error is at most κ e,
largest at the kink and alike on both sides of it, and as D decays, so does the error away from the kink. Computing D,
and not p, keeps the difference p - max(t, 0) exact where it is tiny.

A jump c of the traction at a is a summand c (x - a)₊ of j. Replacing (x - a)₊ by p(x - a; ε/|c|) adds
sign(c) ε D(|c| |x - a|/ε): up to κ ε, an energy per area, whatever the jump. Upward jumps are those of H,
downward ones those of G, so H + ε ΣD and G + ε ΣD are convex again: the smoothed law's own split.

The paper smooths its own law otherwise (Ovcharova and Gwinner, section 5.2): -j = max{g1, g2} with g1 = -γ1/(2δ) x²,
g2 = -γ2 |x| is replaced by S = g1 + p(d; ε), where d = g2 - g1 and p is the quadratic plus function. Both pieces also
meet at x = 0, so S acts there too, for every ε, however small: the smoothed even law has a false kink at zero slip,
where its subdifferential is [-γ2/2, γ2/2]. For results as the paper's, use this; for results as the law's, a plus
function.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from ..class_registry import enter, hint
from ..errors import InputError
from ..typing import Array
from .base import ConvexPart, DerivedLaw, DifferentiablePart, Superpotential, quotient
from .catalogue import QuadraticLinear
from .registry import require_positive
from .traction_graph import TractionGraph

_LARGEST = float(np.finfo(np.float64).max)
_REGISTRY: dict[str, type] = {}


class Smoothing(ABC):
    """A way to smooth laws. A subclass with a `name` can be named in a scene: `smoothing = "name"`.

    It is made without arguments. To add a plus function, subclass :class:`PlusFunction` instead.

    Class attributes:
        name: the scene's name for it.
        laws: names of the laws that it can smooth; None: all.
    """

    name: ClassVar[str]
    laws: ClassVar[tuple[str, ...] | None] = None

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "name" in cls.__dict__:
            enter(_REGISTRY, cls, cls.name, "smoothing")

    @abstractmethod
    def smooth(self, law: Superpotential, epsilon_absolute: float) -> SmoothedLaw:
        """The law, smoothed.

        Args:
            law: with kinks or without.
            epsilon_absolute: the width ε > 0, N/m.

        Raises:
            InputError: the law is none of `laws`, or ε is no finite number > 0.
        """

    def relative(self, law: Superpotential, epsilon: float) -> SmoothedLaw:
        """The law, smoothed with a width relative to its energy scale.

        Args:
            law: as for :meth:`smooth`.
            epsilon: the width > 0 over the law's energy scale.

        Raises:
            InputError: as for :meth:`smooth`.
        """
        require_positive("smoothing", epsilon=epsilon)
        return self.smooth(law, epsilon * law.energy_scale)


def registered() -> dict[str, type[Smoothing]]:
    """All smoothings by their names, sorted; the user's own among them."""
    return dict(sorted(_REGISTRY.items()))


def create(
    name: str, law: Superpotential, *, epsilon: float | None = None, epsilon_absolute: float | None = None
) -> SmoothedLaw:
    """The law, smoothed as a scene says it.

    Args:
        name: of the smoothing.
        law: with kinks or without.
        epsilon: the width ε relative to the law's energy scale.
        epsilon_absolute: instead, the width ε in N/m.

    Raises:
        InputError: the name is unknown, not exactly one ε is given, it is no finite number > 0, or the smoothing cannot
            smooth this law.
    """
    kind = registered().get(name)
    if kind is None:
        raise InputError(f"unknown smoothing {name!r}{hint(name, registered())}; available: {', '.join(registered())}")
    if epsilon is not None and epsilon_absolute is None:
        return kind().relative(law, epsilon)
    if epsilon_absolute is not None and epsilon is None:
        return kind().smooth(law, epsilon_absolute)
    raise InputError(
        "smoothing: give either epsilon (relative to the law's energy scale, for example 0.01) "
        "or epsilon_absolute (in N/m)"
    )


@dataclass(frozen=True)
class SmoothedLaw(DerivedLaw, register=False):
    """A law smoothed with a width ε (N/m): what all smoothings leave as the law has it."""

    epsilon_absolute: float

    def __post_init__(self) -> None:
        require_positive("smoothing", epsilon_absolute=self.epsilon_absolute)


@dataclass(frozen=True)
class PlusFunction(Smoothing):
    """One smoothing of max(t, 0), and of laws by it: a subclass gives a name and the profile.

    Class attributes:
        bands: distances |t|/e between which D changes little in shape; beyond the last one it is next to nothing.
        parabolic: whether D is a parabola up to the only band, and zero beyond it.
    """

    bands: ClassVar[tuple[float, ...]] = (1.0, 4.0, 16.0, 64.0)
    parabolic: ClassVar[bool] = False

    @abstractmethod
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        """D, D' and D'', which never rises, at z = |t|/e ≥ 0, inf included; each of shape (m,)."""

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
        x, sign = (np.abs(x), np.sign(x)) if self.even else (x, np.ones_like(x))
        slope = self._profiles(x)[1]
        # Right of a kink the plus function's slope is 1 + D', left of it -D'; the 1 is the part's own jump.
        turned = np.where(x[:, None] >= self.part.kinks, slope, -slope)
        return sign * (self.part.right(x) + turned @ self.part.jumps)

    @override
    def second(self, x: Array) -> Array:
        x = np.abs(x) if self.even else x
        with np.errstate(over="ignore"):
            stiffness = np.minimum(self.part.jumps / self.epsilon * self.part.jumps, _LARGEST)
            return self.part.second(x) + (self._profiles(x)[2] * stiffness).sum(axis=1)

    def correction(self, x: Array) -> Array:
        """What the smoothing adds to the part, from 0 to κ ε for each kink."""
        return self.epsilon * self._profiles(np.abs(x) if self.even else x)[0].sum(axis=1)

    def _profiles(self, x: Array) -> tuple[Array, Array, Array]:
        """D, D', D'' (m, k) of each point and kink, at their distance in units of the kink's width."""
        with np.errstate(over="ignore"):
            return self.plus.profile(np.abs(x[:, None] - self.part.kinks) / self.epsilon * self.part.jumps)


@dataclass(frozen=True)
class PlusSmoothedLaw(SmoothedLaw, register=False):
    """A law smoothed at its kinks by one plus function, with ε (N/m) the same for every kink.

    An even law stays even, with traction exactly 0 at zero slip; a kink at zero slip is smoothed like any.
    The scales are those of the law. `peak` and `c4` are bounds from above, sharp to a relative 1e-6.
    """

    name = "smoothed"
    plus: PlusFunction

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
        return self.law.value(x) + (self.convex.correction(x) - self.concave.correction(x))

    @cached_property
    @override
    def convex(self) -> SmoothedPart:
        return self._smoothed(self.law.convex)

    @cached_property
    @override
    def concave(self) -> SmoothedPart:
        return self._smoothed(self.law.concave)

    def _smoothed(self, part: ConvexPart) -> SmoothedPart:
        return SmoothedPart(part, self.plus, self.epsilon_absolute, self.law.even)

    @override
    @cached_property
    def graph(self) -> TractionGraph | None:
        if not (self.plus.parabolic and self.law.graph is not None):
            return None
        ends, tails = self.breaks, self.law.graph.slopes
        return TractionGraph.chords(ends, self.left(ends), self.right(ends), (float(tails[0]), float(tails[-1])))

    @property
    @override
    def steepest_fall(self) -> float:
        if self.graph is not None:
            return self.graph.steepest_fall
        drops, jumps = self.law.concave.kinks, self.law.concave.jumps
        if self.law.graph is None or not drops.size:
            return self.law.steepest_fall  # what smooths an upward jump rises
        ends = np.concatenate([[-np.inf], 0.5 * (drops[1:] + drops[:-1]), [np.inf]])[:, None]
        away = np.maximum(np.maximum(ends[:-1] - drops, drops - ends[1:]), 0.0)  # of the places nearest to each drop
        falls = self.plus.profile(away / self.epsilon_absolute * jumps)[2] @ (jumps / self.epsilon_absolute * jumps)
        return max(0.0, -float(np.min(self.law.graph.slopes))) + float(np.max(falls))

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
    bands = (0.5,)
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
    bands = (2.0, 8.0, 32.0)

    @override
    def profile(self, z: Array) -> tuple[Array, Array, Array]:
        small = np.exp(-z)
        share = small / (1.0 + small)
        return np.log1p(small), -share, share / (1.0 + small)


QUADRATIC = Quadratic()


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

    -S'' = s (1 - p'(d)) - d'² p''(d) with s = γ1/δ. The second term is zero but for two bands of slips, |d| < ε/2, and
    there is G''; H = G - S has the kink.
    """

    name = "paper_smoothing"
    law: QuadraticLinear

    @override
    def value(self, x: Array) -> Array:
        y, law = np.abs(x), self.law
        with np.errstate(over="ignore"):
            exact = np.minimum(0.5 * self.slope * y * y, law.gamma2 * y)
            z = np.abs(self._gap(y)) / self.epsilon_absolute
        return exact - self.epsilon_absolute * QUADRATIC.profile(z)[0]

    @cached_property
    @override
    def convex(self) -> ConvexPart:
        return _PaperConvex(self)

    @cached_property
    @override
    def concave(self) -> _PaperConcave:
        return _PaperConcave(self)

    @cached_property
    def bands(self) -> tuple[Array, Array]:
        """The slips y ≥ 0 where -S'' has its second term: the beginnings of two bands, and their widths."""
        middle, width = 0.5 * self.law.delta, self.epsilon_absolute / self.slope
        inner = min(width / (middle + math.sqrt(max(middle * middle - width, 0.0))), middle)
        outer = width / (middle + math.sqrt(middle * middle + width))
        return np.array([0.0, self.law.delta - inner]), np.array([inner, inner + outer])

    @property
    @override
    def steepest_fall(self) -> float:
        """At the outer end of the band around δ."""
        return self.curvature * (0.5 * self.law.delta) ** 2 + self.slope

    @property
    def curvature(self) -> float:
        """d'² p''(d) over (y - δ/2)², N/m⁵."""
        return self.slope * (self.slope / self.epsilon_absolute)

    @property
    @override
    def breaks(self) -> Array:
        ends = np.add(*self.bands)
        return np.unique([*-ends, *-self.bands[0], *self.bands[0], *ends])

    @property
    def slope(self) -> float:
        """The stiffness γ1/δ of the rising branch, N/m³."""
        return self.law.gamma1 / self.law.delta

    def _gap(self, y: Array) -> Array:
        """The difference d = g2 - g1 at slips y ≥ 0, in N/m; inf where beyond the largest float."""
        with np.errstate(over="ignore"):
            return 0.5 * self.slope * y * (y - self.law.delta)

    def share(self, y: Array) -> Array:
        """p'(d) at slips y ≥ 0: how far the law has passed to its second piece, from 0 to 1."""
        return QUADRATIC.derivative(self._gap(y), self.epsilon_absolute)

    @override
    def left(self, x: Array) -> Array:
        return -self.right(-x)

    @override
    def right(self, x: Array) -> Array:
        """γ2/2 at 0."""
        y = np.abs(x)
        share = self.share(y)
        with np.errstate(over="ignore"):
            rising = np.where(share < 1.0, (1.0 - share) * self.slope * y, 0.0)
        return np.where(x >= 0.0, 1.0, -1.0) * (rising + share * self.law.gamma2)

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        law = QuadraticLinear(self.law.gamma1 / traction, self.law.gamma2 / traction, self.law.delta / length)
        return PaperSmoothedLaw(law, self.epsilon_absolute / (length * traction))


@dataclass(frozen=True, eq=False)
class _PaperConvex(ConvexPart):
    """H = G - S: even, with the false kink of height γ2 at 0."""

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
        return self.law.left(x) + self.law.concave.left(x)

    @override
    def right(self, x: Array) -> Array:
        return self.law.right(x) + self.law.concave.right(x)

    @override
    def second(self, x: Array) -> Array:
        return self.law.slope * (1.0 - self.law.share(np.abs(x)))


@dataclass(frozen=True, eq=False)
class _PaperConcave(DifferentiablePart):
    """G: even, with the second derivative d'² p''(d), which is that of a polynomial in each band."""

    law: PaperSmoothedLaw

    def _within(self, x: Array) -> tuple[Array, Array, Array]:
        """How far slips are beyond the beginning of each band, and within it, (m, 2); how far δ/2 is from it, (2,)."""
        begins, widths = self.law.bands
        beyond = np.abs(x)[:, None] - begins
        return beyond, np.clip(beyond, 0.0, widths), begins - 0.5 * self.law.law.delta

    @override
    def value(self, x: Array) -> Array:
        beyond, c, a = self._within(x)
        grown = c * c * (a * a / 2.0 + a * c / 3.0 + c * c / 12.0) + (beyond - c) * c * (a * a + a * c + c * c / 3.0)
        return self.law.curvature * grown.sum(axis=1)

    @override
    def right(self, x: Array) -> Array:
        _, c, a = self._within(x)
        return np.sign(x) * self.law.curvature * (c * (a * a + a * c + c * c / 3.0)).sum(axis=1)

    @override
    def second(self, x: Array) -> Array:
        beyond, c, a = self._within(x)
        return self.law.curvature * np.where(beyond == c, (a + c) ** 2, 0.0).sum(axis=1)
