"""Laws that start with a convex kink and weaken smoothly: the exponential one, and a base for others."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from typing_extensions import override

from ..typing import Array
from .base import Powers, Superpotential
from .convex_parts import ConvexPart, DifferentiablePart, Directional, folded
from .parameter_checks import require_ordered, require_positive
from .polyline import PolylinePart
from .traction_bounds import Extremes
from .traction_graph import TractionGraph


@dataclass(frozen=True)
class WeakeningLaw(Superpotential):
    """Traction sign(x) [peak - (peak - residual) w(|x|/delta)], weakening from ±peak to ±residual.

    A subclass gives a name and the shape w: w(0) = 0, rising monotonically to w(∞) = 1, with its integral W
    and derivative w'. Split: H = peak |x| and G = (peak - residual) delta W(|x|/delta), which is smooth.
    Tractions in N/m², delta in m; InputError unless 0 ≤ residual ≤ peak, peak > 0 and delta > 0.

    Class attributes:
        concave_shape: whether w' never rises, so that its values at the ends of an interval bound it.
    """

    concave_shape: ClassVar[bool] = False
    powers: ClassVar[Powers] = {"peak_traction": (0, 1), "residual_traction": (0, 1), "delta": (1, 0)}
    peak_traction: float
    residual_traction: float
    delta: float

    def __post_init__(self) -> None:
        require_positive(self._title, delta=self.delta)
        require_ordered(self._title, residual_traction=self.residual_traction, peak_traction=self.peak_traction)

    @abstractmethod
    def shape(self, z: Array) -> tuple[Array, Array, Array]:
        """W(z) = ∫₀ᶻ w, w(z) and w'(z) at slips z = |x|/delta ≥ 0, shape (m,), dimensionless."""

    @override
    @cached_property
    def convex(self) -> ConvexPart:
        return PolylinePart(TractionGraph.from_points([(0.0, self.peak_traction)]))

    @override
    @cached_property
    def concave(self) -> ConvexPart:
        return _Weakened(self)

    @override
    def value(self, x: Array) -> Array:
        return self.convex.value(x) - self.concave.value(x)

    @override
    @cached_property
    def growth(self) -> Directional:
        return Directional(self.residual_traction, self.residual_traction)

    @cached_property
    def _extremes(self) -> Extremes:
        # |traction| falls with |x|: it is largest at the onset of slip, and never acts along the slip.
        peak = self.peak_traction
        return Extremes(peak, peak, c4=0.0)

    @override
    @property
    def energy_scale(self) -> float:
        return self.peak_traction * self.delta

    @override
    @property
    def length_scale(self) -> float:
        return self.delta

    @override
    @property
    def even(self) -> bool:
        return True

    @override
    def scaled(self, length: float, traction: float) -> Superpotential:
        return replace(
            self,
            peak_traction=self.peak_traction / traction,
            delta=self.delta / length,
            residual_traction=self.residual_traction / traction,
        )


@dataclass(frozen=True, eq=False)
class _Weakened(DifferentiablePart):
    """G of a weakening law."""

    law: WeakeningLaw

    @override
    def value(self, x: Array) -> Array:
        return (self._drop * self.law.delta) * self._shape(x)[0]

    @override
    def right(self, x: Array) -> Array:
        return self._drop * np.sign(x) * self._shape(x)[1]

    @override
    def second(self, x: Array) -> Array:
        return (self._drop / self.law.delta) * self._shape(x)[2]

    @override
    def derivatives(self, x: Array) -> tuple[Array, Array]:
        _, share, rate = self._shape(x)
        return self._drop * np.sign(x) * share, (self._drop / self.law.delta) * rate

    @override
    def second_range(self, low: Array, high: Array) -> tuple[Array, Array]:
        if not self.law.concave_shape:
            return super().second_range(low, high)
        near, far = folded(low, high)
        return self.second(far), self.second(near)

    @property
    def _drop(self) -> float:
        return self.law.peak_traction - self.law.residual_traction

    def _shape(self, x: Array) -> tuple[Array, Array, Array]:
        with np.errstate(over="ignore"):
            return self.law.shape(np.abs(x) / self.law.delta)


@dataclass(frozen=True)
class Exponential(WeakeningLaw):
    """Exponential slip weakening: traction sign(x) [residual + (peak - residual) exp(-|x|/delta)]."""

    name = "exponential"
    concave_shape = True

    @override
    def shape(self, z: Array) -> tuple[Array, Array, Array]:
        decay = np.exp(-z)
        return z + np.expm1(-z), -np.expm1(-z), decay
