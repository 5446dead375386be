"""What a superpotential is: the law j with -σ ∈ ∂j(u), and all that a solver and a certificate ask of it.

A law is a locally Lipschitz function j: R → R of one displacement (a slip u_t, in 3D its length, or an
opening), an energy per area in N/m. Its derivative is the traction in N/m². Every law is given by its split
j = H - G into two convex functions (D.C., "difference of convex"); tractions, kinks and pieces follow from it
(:mod:`.split_law`), and what is needed of all displacements together.
Any consistent system of units will do; `scaled` changes it.
"""

from __future__ import annotations

import inspect
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

from typing_extensions import override

from ..class_registry import enter
from ..errors import InputError
from ..typing import Array, Integers
from .convex_parts import ConvexPart, Directional, ScaledPart, SplitLaw, quotient
from .parameter_checks import require_positive
from .traction_bounds import Extremes, extremes
from .traction_graph import TractionGraph

Powers = Mapping[str, tuple[int, int]]
_REGISTRY: dict[str, type] = {}


class Superpotential(SplitLaw):
    """A law j: R → R. To write your own, see docs/laws.md: usually a simpler base class is enough.

    A subclass with a `name` is registered under it (unless declared with `register=False`) and can then be
    named in a scene file; the parameters there are those of its constructor.
    Required: value, convex, concave, growth, energy_scale, length_scale, even. The rest has defaults.
    """

    name: ClassVar[str]
    powers: ClassVar[Powers] = {}
    """The powers of length and traction in the units of parameters, for which formulas may then stand."""

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
    def energy_scale(self) -> float:
        """A typical energy per area, N/m: roughly, the area under the law's graph up to the first kink."""

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

    @property
    def traction_scale(self) -> float:
        """energy_scale / length_scale, N/m²."""
        return self.energy_scale / self.length_scale

    @property
    def peak(self) -> Directional:
        """The largest resistance: Clarke's derivative j⁰(x; ±1) at its supremum over x, N/m².

        Unless a law overrides it, a bound from above, sharp to a relative 1e-6. So is c4.
        """
        return Directional(self._extremes.peak_minus, self._extremes.peak_plus)

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


_KEYS_BESIDE = {"multiplier", "length_multiplier"}
"""What stands in a scene's table beside a law's parameters."""


def _refuse_hidden_properties(cls: type[Superpotential]) -> None:
    """A parameter called `peak`, say, would silently replace the property of that name."""
    known = {key for base in Superpotential.__mro__ for key in vars(base) if not key.startswith("_")}
    reserved = known | _KEYS_BESIDE
    hidden = sorted(reserved & (inspect.get_annotations(cls).keys() - {"name", "powers"}))
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
    @cached_property
    def graph(self) -> TractionGraph | None:
        return None if self.law.graph is None else self.law.graph.scaled(self.length, self.traction)

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
