"""What a superpotential is: the law j with -σ ∈ ∂j(u), and all that a solver and a certificate ask of it.

A law is a locally Lipschitz function j: R → R of one displacement (a slip u_t, in 3D its length, or an
opening), an energy per area in N/m. Its derivative is the traction in N/m²; at a kink of j the traction is
any value of an interval, Clarke's subdifferential ∂j. Every law is given by its split j = H - G into two
convex functions (D.C., "difference of convex"); everything else in this class follows from it.
Any consistent system of units will do; `scaled` changes it.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from ..class_registry import enter
from ..errors import InputError
from ..typing import Array, Integers
from .convex_parts import ConvexPart, Directional, ScaledPart, quotient
from .parameter_checks import require_positive
from .traction_bounds import Extremes, extremes

_REGISTRY: dict[str, type] = {}
_FAR = 1e100
"""A displacement (m) beyond all that a law tells apart."""


class Superpotential(ABC):
    """A law j: R → R. To write your own, see docs/laws.md: usually a simpler base class is enough.

    A subclass with a `name` is registered under it (unless declared with `register=False`) and can then be
    named in a scene file; the parameters there are those of its constructor.
    Required: value, convex, concave, growth, energy_scale, length_scale, even. The rest has defaults.
    """

    name: ClassVar[str]

    def __init_subclass__(cls, *, register: bool = True, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        _refuse_hidden_properties(cls)
        if register and "name" in cls.__dict__:
            enter(_REGISTRY, cls, cls.name, "law")

    @property
    def _title(self) -> str:
        """How messages name it."""
        return f"law {self.name!r}"

    @abstractmethod
    def value(self, x: Array) -> Array:
        """The energy j at displacements x (m,), N/m, with j(0) = 0 (smoothed laws: to within their bound)."""

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
    def is_linear(self) -> bool:
        """Whether the traction is proportional to the displacement, so that j adds nothing nonsmooth."""
        return False

    @cached_property
    def is_convex(self) -> bool:
        """Whether j is convex: the derivative of G, which never falls, is the same at both ends of the line."""
        with np.errstate(all="ignore"):
            low, high = self.concave.right(np.array([-_FAR, _FAR]))
        return bool(low == high)

    @property
    def steepest_fall(self) -> float:
        """A bound from above of -j'', N/m³: 0 where j is convex, inf where the traction drops or no bound is known."""
        return 0.0 if self.is_convex else np.inf

    @property
    def traction_scale(self) -> float:
        """energy_scale / length_scale, N/m²."""
        return self.energy_scale / self.length_scale

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

    @property
    def peak(self) -> Directional:
        """The largest resistance: Clarke's derivative j⁰(x; ±1) at its supremum over x, N/m².

        Unless a law overrides it, a bound from above, sharp to a relative 1e-6. So are c3 and c4.
        """
        return Directional(self._extremes.peak_minus, self._extremes.peak_plus)

    @property
    def c3(self) -> float:
        """Growth condition (i) of Ovcharova and Gwinner, section 4: |η| ≤ c3 (1 + |x|) for η ∈ ∂j(x)."""
        return self._extremes.c3

    @property
    def c4(self) -> float:
        """Growth condition (ii) of Ovcharova and Gwinner, section 4: -η x ≤ c4 |x| for η ∈ ∂j(x)."""
        return self._extremes.c4

    def scaled(self, length: float, traction: float) -> Superpotential:
        """The same law in other units: j(length x) / (length traction).

        Args:
            length: the unit of displacements, m.
            traction: the unit of tractions, N/m².
        """
        return ScaledLaw(self, length, traction)

    @cached_property
    def _extremes(self) -> Extremes:
        return extremes(self)

    def _clarke(self, x: Array) -> tuple[Array, Array]:
        left, right = self.left(x), self.right(x)
        return np.minimum(left, right), np.maximum(left, right)

    def _kinks_within(self, x: Array, atol: float | Array) -> Array:
        if np.size(x) == 0:
            return np.empty(0)
        return self.kinks[(self.kinks >= np.min(x - atol)) & (self.kinks <= np.max(x + atol))]


_KEYS_BESIDE = {"multiplier", "length_multiplier"}
"""What stands in a scene's table beside a law's parameters."""


def _refuse_hidden_properties(cls: type[Superpotential]) -> None:
    """A parameter called `peak`, say, would silently replace the property of that name."""
    reserved = {key for key in vars(Superpotential) if not key.startswith("_")} | _KEYS_BESIDE
    hidden = sorted(reserved & (inspect.get_annotations(cls).keys() - {"name"}))
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
class ScaledLaw(Superpotential, register=False):
    """A law in other units: the default of `Superpotential.scaled`.

    Attributes:
        law: the law.
        length: the unit of displacements.
        traction: the unit of tractions.
    """

    name = "scaled"
    law: Superpotential
    length: float
    traction: float

    def __post_init__(self) -> None:
        require_positive(self._title, length=self.length, traction=self.traction)

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
    @property
    def breaks(self) -> Array:
        return quotient(self.law.breaks, self.length)

    @override
    @property
    def steepest_fall(self) -> float:
        return self.law.steepest_fall * (self.length / self.traction)

    @override
    def piece(self, x: Array) -> Integers:
        return self.law.piece(x * self.length)

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        return ScaledLaw(self.law, self.length * length, self.traction * traction)
