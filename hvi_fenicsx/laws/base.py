"""What a superpotential is: the law j with -σ ∈ ∂j(u), and all that a solver and a certificate ask of it.

A law is a locally Lipschitz function j: R → R of one displacement (a slip u_t, in 3D its length, or an
opening), an energy per area in N/m. Its derivative is the traction in N/m². Every law is given by its split
j = H - G into two convex functions (D.C., "difference of convex"); tractions, kinks and pieces follow from it,
and what is needed of all displacements together.
Any consistent system of units will do; `scaled` changes it.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from ..class_registry import enter
from ..errors import InputError
from ..typing import Array, Integers
from .traction_graph import TractionGraph


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

    @cached_property
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


@dataclass(frozen=True, kw_only=True)
class LawThresholds:
    """Limits of laws, and of the search for extreme tractions.

    Attributes:
        resolution: relative sharpness of the bounds, and of jumps; the least displacement sampled, over the length
            scale; its inverse, squared, is the largest one, over the largest of 1, the length scale and the kinks.
        samples: displacements of the first grid, in geometric progression; bisection goes on up to the square of it.
        most_drops: drops of a sawtooth: each is a piece of the law, which is looked at at every vertex.
    """

    resolution: float = 1e-6
    samples: int = 400
    most_drops: int = 1_000


DEFAULT = LawThresholds()
Units = Mapping[str, str]
_REGISTRY: dict[str, type] = {}


class Superpotential(ABC):
    """A law j: R → R. To write your own, see docs/laws.md: usually a simpler base class is enough.

    A subclass with a `name` is registered under it (unless declared with `register=False`) and can then be
    named in a scene file; the parameters there are those of its constructor.
    Required: value, convex, concave, growth, energy_scale, length_scale, even. The rest has defaults.
    """

    name: ClassVar[str]
    units: ClassVar[Units] = {}
    """Whether parameters grow with the law's lengths or its tractions; formulas may then stand for them."""

    def __init_subclass__(cls, *, register: bool = True, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _refuse_hidden_properties(cls)
        if register and "name" in cls.__dict__:
            enter(_REGISTRY, cls, cls.name, "law")

    @property
    def _title(self) -> str:
        """How messages name it."""
        return f"law {self.name!r}"

    @property
    @abstractmethod
    def convex(self) -> ConvexPart:
        """H of the split j = H - G: the rising parts and upward jumps of the traction."""

    @property
    @abstractmethod
    def concave(self) -> ConvexPart:
        """G of the split j = H - G, convex as well: the falling parts and downward jumps of the traction."""

    @abstractmethod
    def value(self, x: Array) -> Array:
        """The energy j at displacements x (m,), N/m, with j(0) = 0 (smoothed laws: to within their bound)."""

    @property
    @abstractmethod
    def growth(self) -> Directional:
        """j^∞(±1) = lim j(±t)/t for t → ∞, in N/m²: the residual resistance."""

    @property
    @abstractmethod
    def energy_scale(self) -> float:
        """A typical energy per area, N/m: roughly, the area under the law's graph up to the first kink."""

    @property
    @abstractmethod
    def length_scale(self) -> float:
        """A displacement typical of the law, m: where its first kink off zero lies."""

    @property
    @abstractmethod
    def even(self) -> bool:
        """Whether j(-x) = j(x), so that the law can act on the length of a slip in 3D."""

    @property
    def graph(self) -> TractionGraph | None:
        """The table of the traction where that is piecewise linear; None where it is curved."""
        return None

    @property
    def is_linear(self) -> bool:
        """Whether the traction is proportional to the displacement, so that j adds nothing nonsmooth."""
        return False

    @cached_property
    def is_convex(self) -> bool:
        """Whether j is convex: the derivative of G, which never falls, is the same at both ends of the line."""
        far = np.sqrt(np.finfo(np.float64).max)
        with np.errstate(all="ignore"):
            low, high = self.concave.right(np.array([-far, far]))
        return bool(low == high)

    @property
    def steepest_fall(self) -> float:
        """A bound from above of -j'', N/m³: 0 where j is convex, inf where the traction drops or no bound is known."""
        return 0.0 if self.is_convex else np.inf

    @property
    def traction_scale(self) -> float:
        """energy_scale / length_scale, N/m²."""
        return self.energy_scale / self.length_scale

    @property
    def peak(self) -> Directional:
        """The largest resistance: Clarke's derivative j⁰(x; ±1) at its supremum over x, N/m².

        Unless a law overrides it, a bound from above, sharp to a relative 1e-6. So is c4.
        """
        return self._extremes[0]

    @property
    def c4(self) -> float:
        """Growth condition (ii) of Ovcharova and Gwinner, section 4: -η x ≤ c4 |x| for η ∈ ∂j(x)."""
        return self._extremes[1]

    @cached_property
    def _extremes(self) -> tuple[Directional, float]:
        """The largest resistance and c4."""
        return extremes(self)

    def scaled(self, length: float, traction: float) -> Superpotential:
        """The same law in other units: j(length x) / (length traction).

        Args:
            length: the unit of displacements, m.
            traction: the unit of tractions, N/m².
        """
        return ScaledLaw(self, length, traction)

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
        return self.right(x), self.convex.second(x) - self.concave.second(x)

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
        first, last = self._kinks_near(x, atol)
        while np.any(near := first < last):
            low, high = self._clarke(self.kinks[np.where(near, first, 0)])
            lo, hi = np.where(near, np.minimum(lo, low), lo), np.where(near, np.maximum(hi, high), hi)
            first = first + 1
        return lo, hi

    def distance(self, x: Array, traction: Array, atol: float | Array = 0.0) -> Array:
        """Distance (m,) of a traction from ∂j(x), N/m²; zero if the law allows it.

        Args:
            x: displacements (m,), m.
            traction: (m,), N/m².
            atol: see `interval`.
        """
        lo, hi = self.interval(x, atol)
        return np.maximum(np.maximum(lo - traction, traction - hi), 0.0)

    def piece(self, x: Array) -> Integers:
        """Index (m,) of the law's piece that x lies on, counted from 0 by |x|; this default knows one."""
        return np.zeros(np.shape(x), dtype=np.int64)

    def branch(self, x: Array, atol: float | Array = 0.0) -> Integers:
        """Index (m,) of the active piece, counted from 0 by |x|; -1 on a kink.

        Args:
            x: displacements (m,), m.
            atol: the distance from a kink, or one for each displacement, m, that counts as being on it.
        """
        first, last = self._kinks_near(x, atol)
        return np.where(first < last, -1, self.piece(x))

    def _clarke(self, x: Array) -> tuple[Array, Array]:
        left, right = self.left(x), self.right(x)
        return np.minimum(left, right), np.maximum(left, right)

    def _kinks_near(self, x: Array, atol: float | Array) -> tuple[Integers, Integers]:
        """The number of the first kink within a distance, and of the first beyond it, (m,) each."""
        return self.kinks.searchsorted(x - atol), self.kinks.searchsorted(x + atol, side="right")


_KEYS_BESIDE = {"multiplier", "length_multiplier"}
"""What stands in a scene's table beside a law's parameters."""


def _refuse_hidden_properties(cls: type[Superpotential]) -> None:
    """A parameter called `peak`, say, would silently replace the property of that name."""
    known = {key for base in Superpotential.__mro__ for key in vars(base) if not key.startswith("_")}
    hidden = sorted((known | _KEYS_BESIDE) & (inspect.get_annotations(cls).keys() - {"name", "units"}))
    if hidden:
        raise InputError(
            f"law class {cls.__name__}: the parameter name {hidden[0]!r} is taken by a property that "
            f"every law has, or by a key beside its parameters; choose another, for example "
            f"{hidden[0] + '_parameter'!r}"
        )


def registered() -> dict[str, type[Superpotential]]:
    """All laws that can be created by name, sorted by it."""
    return dict(sorted(_REGISTRY.items()))


@dataclass(frozen=True)
class DerivedLaw(Superpotential, register=False):
    """A law made of another one, whose scales it has, in units of its own if a subclass has such.

    Attributes:
        law: the other one.
    """

    law: Superpotential
    length = traction = 1.0

    @override
    @property
    def growth(self) -> Directional:
        growth = self.law.growth
        return Directional(growth.minus / self.traction, growth.plus / self.traction)

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
    def piece(self, x: Array) -> Integers:
        return self.law.piece(x * self.length)


@dataclass(frozen=True)
class ScaledLaw(DerivedLaw, register=False):
    """A law in other units: the default of `Superpotential.scaled`.

    Attributes:
        length: the unit of displacements.
        traction: the unit of tractions.
    """

    name = "scaled"
    length: float
    traction: float

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
    @cached_property
    def _extremes(self) -> tuple[Directional, float]:
        return self.law.peak.times(1.0 / self.traction), self.law.c4 / self.traction

    @override
    @property
    def breaks(self) -> Array:
        return quotient(self.law.breaks, self.length)

    @override
    @property
    def steepest_fall(self) -> float:
        return self.law.steepest_fall * (self.length / self.traction)


def extremes(law: Superpotential) -> tuple[Directional, float]:
    """The largest resistance and c4 of a law known only by its split j = H - G: bounds from above by bisection.

    On an interval (a, b) the traction j' = H' - G' lies in [H'(a+) - G'(b-), H'(b-) - G'(a+)], since H' and G'
    are monotone. Bisecting wherever this bound still exceeds the best sample gives a bound from above that
    is as sharp as wished: no peak, however narrow, can hide between samples.

    Args:
        law: by its split.
    """
    unit, kinks, parts = law.length_scale, np.abs(law.kinks), (law.convex, law.concave)
    ends = DEFAULT.resolution * unit, DEFAULT.resolution**-2 * max(unit, 1.0, *kinks)
    ahead = np.unique(np.concatenate([[0.0], kinks, np.geomspace(*ends, DEFAULT.samples)]))
    (low,), (high,) = law.interval(np.zeros(1))
    plus, against = _supremum(*parts, ahead), _supremum(*parts[::-1], ahead)
    along, minus = _supremum(*parts, -ahead[::-1]), _supremum(*parts[::-1], -ahead[::-1])
    peak = Directional(max(law.growth.minus, -low, against, minus), max(law.growth.plus, high, plus, along))
    return peak, max(0.0, against, along)


def _supremum(up: ConvexPart, down: ConvexPart, grid: Array) -> float:
    """A bound from above of the derivative of one part less another, over the range of the grid but for 0."""

    def sampled(x: Array) -> Array:
        return np.stack([up.left(x) - down.left(x), up.right(x) - down.right(x)])

    a, b, values = grid[:-1], grid[1:], sampled(grid[grid != 0.0])
    best, tolerance = float(values.max()), DEFAULT.resolution * float(np.abs(values).max())
    while (undecided := (bound := up.left(b) - down.right(a)) > best + tolerance).any():
        a, b = a[undecided], b[undecided]
        middle = 0.5 * (a + b)
        if a.size > DEFAULT.samples**2 or np.any((middle == a) | (middle == b)):
            break
        best = max(best, float(sampled(middle).max()))
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
    if undecided.any():
        return float(bound.max())
    return best + tolerance if best > 0 else best
